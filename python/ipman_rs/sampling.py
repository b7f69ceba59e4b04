"""Sampling: N_U points on the surface that move with it."""

from __future__ import annotations

from typing import Any

from numpy.typing import ArrayLike, NDArray

from ipman_rs import quantities
from ipman_rs.arrays import Bodies
from ipman_rs.ground import ANYWHERE
from ipman_rs.template import BodyTemplate


def sample_surface(vertices: ArrayLike, template: BodyTemplate) -> NDArray[Any]:
    """The samples v = W V, (..., S, 3) m. vertices (..., V, 3) m.

    Raises:
        ValueError: wrong shape.
        TypeError: an argument of the wrong kind, or masked vertices.
    """
    return Bodies(vertices, template).evaluate(quantities.sample_surface(template), ANYWHERE)
