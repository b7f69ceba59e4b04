"""Pressure (Eq. 2 of the paper) and the centre of pressure (Eq. 3), from the samples' heights."""

from __future__ import annotations

from typing import Any

from numpy.typing import ArrayLike, NDArray

from ipman_rs.arrays import Bodies
from ipman_rs.checks import not_negative, number
from ipman_rs.ground import Ground
from ipman_rs.template import BodyTemplate


def pressure(
    vertices: ArrayLike, template: BodyTemplate, ground: Ground, alpha: float = 100.0, gamma: float = 10.0
) -> NDArray[Any]:
    """ρ = 1 − αh below the ground, e^(−γh) from the ground up (Eq. 2), of each sample: (..., S), no unit.

    vertices (..., V, 3) m; alpha, gamma in 1/m.
    """
    options = [number("alpha", alpha), number("gamma", gamma)]
    return Bodies(vertices, template).evaluate("pressure", options, ground, template.num_samples)


def center_of_pressure(
    vertices: ArrayLike,
    template: BodyTemplate,
    ground: Ground,
    alpha: float = 100.0,
    gamma: float = 10.0,
    epsilon: float = 0.0,
) -> NDArray[Any]:
    """s̄ = Σ ρ v / (Σ ρ + epsilon) (Eq. 3), (..., 3) m; finite for hovering bodies.

    epsilon: 0 in the paper, 1e-6 in the released code.
    """
    options = [number("alpha", alpha), number("gamma", gamma), not_negative("epsilon", epsilon)]
    return Bodies(vertices, template).evaluate("center_of_pressure", options, ground, 3)
