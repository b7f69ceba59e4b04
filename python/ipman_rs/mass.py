"""The centre of mass: the paper's pCoM (Eq. 1) and the other formulations."""

from __future__ import annotations

from typing import Any, Literal

from numpy.typing import ArrayLike, NDArray

from ipman_rs.arrays import Bodies
from ipman_rs.checks import choice
from ipman_rs.ground import Ground
from ipman_rs.template import BodyTemplate

Method = Literal["pcom", "vertex_mean", "sample_mean", "face_area", "exact"]


def center_of_mass(vertices: ArrayLike, template: BodyTemplate, method: Method = "pcom") -> NDArray[Any]:
    """The centre of mass, (..., 3) m. vertices (..., V, 3) m.

    `pcom` is the paper's (Eq. 1): samples weighted by their part's volume. `vertex_mean`, `sample_mean` and `face_area`
    are the alternatives of its supplement; `exact` integrates a solid of uniform density. On a standing body pcom and
    exact lie several centimetres apart, because samples sit on the skin.
    """
    return Bodies(vertices, template).evaluate(f"center_of_mass.{choice('method', method, Method)}", [], Ground(), 3)
