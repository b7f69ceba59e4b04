"""Points on the surface."""

from __future__ import annotations

from torch import Tensor

from ipman_rs import BodyTemplate

from .dispatch import evaluate


def sample_surface(vertices: Tensor, template: BodyTemplate) -> Tensor:
    """The template's samples on posed bodies: vertices (..., V, 3) -> (..., S, 3), m."""
    return evaluate(vertices, template, None, "sample_surface", (), (template.num_samples, 3))
