"""The centre of mass: the paper's pCoM (Eq. 1) and the other formulations."""

from __future__ import annotations

from typing import Any

from numpy.typing import ArrayLike, NDArray

from ipman_rs import quantities
from ipman_rs.arrays import Bodies
from ipman_rs.ground import ANYWHERE
from ipman_rs.quantities import Method
from ipman_rs.template import BodyTemplate


def center_of_mass(vertices: ArrayLike, template: BodyTemplate, method: Method = "pcom") -> NDArray[Any]:
    """The centre of mass, (..., 3) m. vertices (..., V, 3) m.

    `pcom` is the paper's (Eq. 1): samples weighted by their part's volume. `vertex_mean`, `sample_mean` and `face_area`
    are the alternatives of its supplement; `exact` integrates a solid of uniform density. On a standing body pcom and
    exact lie several centimetres apart, because samples sit on the skin.

    Raises:
        ValueError: wrong shape, or unknown method.
        TypeError: an argument of the wrong kind, or masked vertices.
    """
    return Bodies(vertices, template).evaluate(quantities.center_of_mass(method), ANYWHERE)
