"""The loss terms of each body: stability, ground, balance. Unreduced; IntuitivePhysicsLoss reduces and weighs them."""

from __future__ import annotations

from torch import Tensor

from ipman_rs import BodyTemplate, quantities
from ipman_rs import Ground as NumpyGround
from ipman_rs.quantities import Curve, Method, Points, Wrap

from .dispatch import evaluate
from .ground import Ground

__all__ = ["balance_cost", "ground_loss", "stability_loss"]  # what `ipman_rs.torch` has of this module


def stability_loss(
    vertices: Tensor,
    template: BodyTemplate,
    ground: Ground | NumpyGround,
    alpha: float = 100.0,
    gamma: float = 10.0,
    epsilon: float = 0.0,
    method: Method = "pcom",
) -> Tensor:
    """‖g(CoM) − g(CoP)‖ (Eq. 4): vertices (..., V, 3) -> (...), m; gradient 0 where they coincide.

    Raises:
        ValueError: wrong shapes, a ground that does not fit the batch, an option out of its range, or an unknown word.
        TypeError: vertices is no ordinary floating-point tensor, or an argument is of the wrong kind.
    """
    return evaluate(vertices, template, ground, quantities.stability_loss(alpha, gamma, epsilon, method))


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

    Raises:
        ValueError: wrong shapes, a ground that does not fit the batch, an option out of its range, or an unknown word.
        TypeError: vertices is no ordinary floating-point tensor, or an argument is of the wrong kind.
    """
    quantity = quantities.ground_loss(alpha1, alpha2, beta1, beta2, points, curve)
    pull, push = evaluate(vertices, template, ground, quantity).unbind(dim=-1)
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

    Raises:
        ValueError: wrong shapes, a ground that does not fit the batch, an option out of its range, or an unknown word.
        TypeError: vertices is no ordinary floating-point tensor, or an argument is of the wrong kind.
    """
    return evaluate(vertices, template, ground, quantities.balance_cost(alpha, gamma, sigma, wrap, method))
