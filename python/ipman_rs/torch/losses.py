"""The terms a body: stability, ground, balance. Unreduced; IntuitivePhysicsLoss reduces and weighs them."""

from __future__ import annotations

from torch import Tensor

from ipman_rs import BodyTemplate
from ipman_rs import Ground as NumpyGround
from ipman_rs.checks import choice, not_negative, positive
from ipman_rs.losses import Curve, Points, Wrap
from ipman_rs.mass import Method

from .dispatch import evaluate
from .ground import Ground


def stability_loss(
    vertices: Tensor,
    template: BodyTemplate,
    ground: Ground | NumpyGround,
    alpha: float = 100.0,
    gamma: float = 10.0,
    epsilon: float = 0.0,
    method: Method = "pcom",
) -> Tensor:
    """‖g(CoM) − g(CoP)‖ (Eq. 4): vertices (..., V, 3) -> (...), m; gradient 0 where they coincide."""
    quantity = f"stability_loss.{choice('method', method, Method)}"
    options = (not_negative("alpha", alpha), not_negative("gamma", gamma), not_negative("epsilon", epsilon))
    return evaluate(vertices, template, ground, quantity, options, ())


def ground_loss(
    vertices: Tensor,
    template: BodyTemplate,
    ground: Ground | NumpyGround,
    alpha1: float = 1.0,
    alpha2: float = 0.15,
    beta1: float = 10.0,
    beta2: float = 0.15,
    points: Points = "samples",
    curve: Curve = "tanh_squared",
) -> tuple[Tensor, Tensor]:
    """L_ground (Eq. 5) as pull (...), push (...): means over all points of α1 T(h/α2) where h >= 0 (Eq. 6) and of
    β1 T(h/β2) where h < 0 (Eq. 7).

    points: "samples" or "vertices"; curve: "tanh_squared" (tanh x)² or "tanh_of_square" tanh(x²).
    """
    quantity = f"ground_loss.{choice('points', points, Points)}.{choice('curve', curve, Curve)}"
    pull_options = (not_negative("alpha1", alpha1), positive("alpha2", alpha2))
    push_options = (not_negative("beta1", beta1), positive("beta2", beta2))
    options = (*pull_options, *push_options)
    pull, push = evaluate(vertices, template, ground, quantity, options, (2,)).unbind(dim=-1)
    return pull, push


def balance_cost(
    vertices: Tensor,
    template: BodyTemplate,
    ground: Ground | NumpyGround,
    alpha: float = 100.0,
    gamma: float = 50.0,
    sigma: float = 0.02,
    wrap: Wrap = "log",
    method: Method = "pcom",
) -> Tensor:
    """How implausible a redistribution of load over the supports balance needs: vertices (..., V, 3) -> (...), nats.

    wrap: "log" log(1 + J), "saturate" J/(1 + J), or "none". A term of this project, not the paper's.
    """
    quantity = f"balance_cost.{choice('wrap', wrap, Wrap)}.{choice('method', method, Method)}"
    options = (not_negative("alpha", alpha), not_negative("gamma", gamma), positive("sigma", sigma))
    return evaluate(vertices, template, ground, quantity, options, ())
