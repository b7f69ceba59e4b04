"""The vertices of the soles of a body's feet."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ..template import BodyTemplate

_LOWER_LEGS = ("left_lower_leg", "right_lower_leg")


def sole_vertices(template: BodyTemplate, within: float) -> NDArray[np.int64]:
    """The vertices (n,) of both lower legs that lie less than `within` m above the lowest of them in the resting pose.

    The template stands y up and has the ten parts of `PART_NAMES`. The thickness depends on the use: 2 cm
    is the skin that touches the floor under a flat foot, 3 cm the whole foot in a shoe.

    Raises:
        ValueError: the template has no part of such a name.
    """
    missing = [name for name in _LOWER_LEGS if name not in template.part_names]
    if missing:
        raise ValueError(f"template: has no part {missing[0]!r}; it has {', '.join(template.part_names)}")
    parts = [template.part_names.index(name) for name in _LOWER_LEGS]
    rows = np.unique(template.faces[np.isin(template.face_parts, parts)])
    height = template.vertices[rows, 1]
    return rows[height < height.min() + within]
