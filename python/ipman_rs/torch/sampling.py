"""Points on the surface."""

from __future__ import annotations

from torch import Tensor

from ipman_rs import BodyTemplate, quantities

from .dispatch import evaluate


def sample_surface(vertices: Tensor, template: BodyTemplate) -> Tensor:
    """The template's samples on posed bodies: vertices (..., V, 3) -> (..., S, 3), m.

    Raises:
        ValueError: wrong shape.
        TypeError: vertices is no ordinary floating-point tensor, or the template is none.
    """
    return evaluate(vertices, template, None, quantities.sample_surface(template))
