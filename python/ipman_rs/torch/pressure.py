"""Pressure by height (Eq. 2 of the paper), and its centre (Eq. 3)."""

from __future__ import annotations

from torch import Tensor

from ipman_rs import BodyTemplate, quantities
from ipman_rs import Ground as NumpyGround

from .dispatch import evaluate
from .ground import Ground


def pressure(
    vertices: Tensor, template: BodyTemplate, ground: Ground | NumpyGround, alpha: float = 100.0, gamma: float = 10.0
) -> Tensor:
    """Relative pressure of each sample (Eq. 2): 1 − αh below the ground, e^{−γh} above: (..., V, 3) -> (..., S).

    Raises:
        ValueError: wrong shapes, a ground that does not fit the batch, or an option out of its range.
        TypeError: vertices is no ordinary floating-point tensor, or an argument is of the wrong kind.
    """
    return evaluate(vertices, template, ground, quantities.pressure(alpha, gamma, template))


def center_of_pressure(
    vertices: Tensor,
    template: BodyTemplate,
    ground: Ground | NumpyGround,
    alpha: float = 100.0,
    gamma: float = 10.0,
    epsilon: float = 0.0,
) -> Tensor:
    """Σ ρ v / (Σ ρ + ε) (Eq. 3): vertices (..., V, 3) -> (..., 3), m; finite for hovering bodies when ε = 0.

    Raises:
        ValueError: wrong shapes, a ground that does not fit the batch, or an option out of its range.
        TypeError: vertices is no ordinary floating-point tensor, or an argument is of the wrong kind.
    """
    return evaluate(vertices, template, ground, quantities.center_of_pressure(alpha, gamma, epsilon))
