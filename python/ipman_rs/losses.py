"""The losses: one number a body each, unweighted."""

from __future__ import annotations

from typing import Any

from numpy.typing import ArrayLike, NDArray

from ipman_rs import quantities
from ipman_rs.arrays import Bodies
from ipman_rs.ground import Ground
from ipman_rs.quantities import Curve, Method, Points, Wrap
from ipman_rs.template import BodyTemplate

__all__ = ["balance_cost", "ground_loss", "stability_loss"]  # what `ipman_rs` has of this module


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

    Raises:
        ValueError: wrong shapes, a ground that does not fit the batch, an option out of its range, or unknown method.
        TypeError: an argument of the wrong kind, or masked vertices.
    """
    return Bodies(vertices, template).evaluate(quantities.stability_loss(alpha, gamma, epsilon, method), ground)


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

    Raises:
        ValueError: wrong shapes, a ground that does not fit the batch, an option out of its range, or an unknown word.
        TypeError: an argument of the wrong kind, or masked vertices.
    """
    quantity = quantities.ground_loss(alpha1, alpha2, beta1, beta2, points, curve)
    both = Bodies(vertices, template).evaluate(quantity, ground)
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

    Raises:
        ValueError: wrong shapes, a ground that does not fit the batch, an option out of its range, or an unknown word.
        TypeError: an argument of the wrong kind, or masked vertices.
    """
    return Bodies(vertices, template).evaluate(quantities.balance_cost(alpha, gamma, sigma, wrap, method), ground)
