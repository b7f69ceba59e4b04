"""Pressure by height (Eq. 2 of the paper), and its centre (Eq. 3)."""

from __future__ import annotations

from torch import Tensor

from ipman_rs import BodyTemplate
from ipman_rs import Ground as NumpyGround
from ipman_rs.checks import body_template, not_negative

from .dispatch import evaluate
from .ground import Ground


def pressure(
    vertices: Tensor, template: BodyTemplate, ground: Ground | NumpyGround, alpha: float = 100.0, gamma: float = 10.0
) -> Tensor:
    """Relative pressure of each sample (Eq. 2): 1 − αh below the ground, e^{−γh} above: (..., V, 3) -> (..., S)."""
    options = (not_negative("alpha", alpha), not_negative("gamma", gamma))
    return evaluate(vertices, template, ground, "pressure", options, (body_template(template).num_samples,))


def center_of_pressure(
    vertices: Tensor,
    template: BodyTemplate,
    ground: Ground | NumpyGround,
    alpha: float = 100.0,
    gamma: float = 10.0,
    epsilon: float = 0.0,
) -> Tensor:
    """Σ ρ v / (Σ ρ + ε) (Eq. 3): vertices (..., V, 3) -> (..., 3), m; finite for hovering bodies when ε = 0."""
    options = (not_negative("alpha", alpha), not_negative("gamma", gamma), not_negative("epsilon", epsilon))
    return evaluate(vertices, template, ground, "center_of_pressure", options, (3,))
