"""Centre of mass."""

from __future__ import annotations

from torch import Tensor

from ipman_rs import BodyTemplate, quantities
from ipman_rs.quantities import Method

from .dispatch import evaluate


def center_of_mass(vertices: Tensor, template: BodyTemplate, method: Method = "pcom") -> Tensor:
    """vertices (..., V, 3) -> (..., 3), m.

    method: "pcom" (the paper's Eq. 1, parts weighted by volume), "vertex_mean", "sample_mean", "face_area", or "exact".

    Raises:
        ValueError: wrong shape, or unknown method.
        TypeError: vertices is no ordinary floating-point tensor, or the template is none.
    """
    return evaluate(vertices, template, None, quantities.center_of_mass(method))
