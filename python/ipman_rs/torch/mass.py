"""Centre of mass."""

from __future__ import annotations

from typing import get_args

from torch import Tensor

from ipman_rs import BodyTemplate
from ipman_rs.mass import Method

from .choice import chosen
from .dispatch import evaluate

COM_METHODS: tuple[Method, ...] = get_args(Method)


def center_of_mass(vertices: Tensor, template: BodyTemplate, method: Method = "pcom") -> Tensor:
    """vertices (..., V, 3) -> (..., 3), m.

    method: "pcom" (the paper's, parts weighted by volume), "vertex_mean", "sample_mean", "face_area", or "exact".

    Raises:
        ValueError: unknown method.
    """
    return evaluate(vertices, template, None, f"center_of_mass.{chosen('method', method, COM_METHODS)}", (), (3,))
