"""Centre of mass."""

from __future__ import annotations

from torch import Tensor

from ipman_rs import BodyTemplate
from ipman_rs.checks import choice
from ipman_rs.mass import Method

from .dispatch import evaluate


def center_of_mass(vertices: Tensor, template: BodyTemplate, method: Method = "pcom") -> Tensor:
    """vertices (..., V, 3) -> (..., 3), m.

    method: "pcom" (the paper's Eq. 1, parts weighted by volume), "vertex_mean", "sample_mean", "face_area", or "exact".

    Raises:
        ValueError: unknown method.
    """
    return evaluate(vertices, template, None, f"center_of_mass.{choice('method', method, Method)}", (), (3,))
