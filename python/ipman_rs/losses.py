"""The losses: one number a body each, unweighted."""

from __future__ import annotations

from typing import Any, Literal

from numpy.typing import ArrayLike, NDArray

from ipman_rs.arrays import Bodies
from ipman_rs.checks import choice, not_negative, positive
from ipman_rs.ground import Ground
from ipman_rs.mass import Method
from ipman_rs.template import BodyTemplate

Points = Literal["samples", "vertices"]
Curve = Literal["tanh_squared", "tanh_of_square"]
Wrap = Literal["log", "saturate", "none"]


def stability_loss(
    vertices: ArrayLike,
    template: BodyTemplate,
    ground: Ground,
    alpha: float = 100.0,
    gamma: float = 10.0,
    epsilon: float = 0.0,
    method: Method = "pcom",
) -> NDArray[Any]:
    """L_stability = ‖g(m̄) − g(s̄)‖₂ (Eq. 4), (...,) m: centre of mass to centre of pressure, on the ground.

    vertices (..., V, 3) m; alpha, gamma, epsilon as in `center_of_pressure`; method as in `center_of_mass`.
    """
    options = [not_negative("alpha", alpha), not_negative("gamma", gamma), not_negative("epsilon", epsilon)]
    quantity = f"stability_loss.{choice('method', method, Method)}"
    return Bodies(vertices, template).evaluate(quantity, options, ground)


def ground_loss(
    vertices: ArrayLike,
    template: BodyTemplate,
    ground: Ground,
    alpha1: float = 1.0,
    alpha2: float = 0.15,
    beta1: float = 10.0,
    beta2: float = 0.15,
    points: Points = "samples",
    curve: Curve = "tanh_squared",
) -> tuple[NDArray[Any], NDArray[Any]]:
    """L_ground (Eq. 5) as (pull, push), each (...,): means over all points of α1 tanh(h/α2)² where h ≥ 0 (Eq. 6) and of
    β1 tanh(h/β2)² where h < 0 (Eq. 7).

    Args:
        vertices: (..., V, 3) m.
        alpha1, beta1: weights; alpha2, beta2: widths, m.
        points: the surface samples or the mesh's vertices.
        curve: (tanh x)², the paper's, or tanh(x²).
    """
    pull = [not_negative("alpha1", alpha1), positive("alpha2", alpha2)]
    push = [not_negative("beta1", beta1), positive("beta2", beta2)]
    quantity = f"ground_loss.{choice('points', points, Points)}.{choice('curve', curve, Curve)}"
    both = Bodies(vertices, template).evaluate(quantity, pull + push, ground, 2)
    return both[..., 0][()], both[..., 1][()]


def balance_cost(
    vertices: ArrayLike,
    template: BodyTemplate,
    ground: Ground,
    alpha: float = 100.0,
    gamma: float = 50.0,
    sigma: float = 0.02,
    wrap: Wrap = "log",
    method: Method = "pcom",
) -> NDArray[Any]:
    """How implausible a redistribution of load over the existing supports balance would need, (...,) nats.

    A term of our own beside the paper's stability loss: J = min_w KL(w‖p) over weights w whose centre lies under the
    centre of mass, p the pressure distribution, supports blurred by sigma metres. Unlike the paper's norm it does not
    assume how separate supports share the load. `wrap`: log(1 + J), J/(1 + J) where bodies may be falling, or J.
    """
    options = [not_negative("alpha", alpha), not_negative("gamma", gamma), positive("sigma", sigma)]
    quantity = f"balance_cost.{choice('wrap', wrap, Wrap)}.{choice('method', method, Method)}"
    return Bodies(vertices, template).evaluate(quantity, options, ground)
