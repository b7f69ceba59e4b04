"""Points on the surface."""

from __future__ import annotations

from torch import Tensor

from ipman_rs import BodyTemplate
from ipman_rs.checks import body_template

from .dispatch import evaluate


def sample_surface(vertices: Tensor, template: BodyTemplate) -> Tensor:
    """The template's samples on posed bodies: vertices (..., V, 3) -> (..., S, 3), m."""
    return evaluate(vertices, template, None, "sample_surface", (), (body_template(template).num_samples, 3))
