"""What can be unusual about one body of a batch, and the warning for bodies that are not in metres."""

from __future__ import annotations

import math
import warnings
from enum import IntFlag
from typing import TYPE_CHECKING, Any, Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

if TYPE_CHECKING:
    from ipman_rs.ground import Ground
    from ipman_rs.template import BodyTemplate


class Status(IntFlag):
    """Bits that may be combined; OK is a good body."""

    OK = 0
    NON_FINITE = 1
    """A coordinate is NaN or infinite: values are NaN, gradients zero."""
    INVERTED_PART = 2
    """A part's signed volume is negative: the posed surface has turned inside out there."""
    NO_CONTACT = 4
    """No sample touches the ground."""
    NO_VOLUME = 8
    """The body encloses no volume, so it has no centre of mass."""
    ODD_SIZE = 16
    """Under 20 cm or over 10 m across: probably not in metres."""
    NOT_SIMULATED = 32
    """The physics engine found no hull of it, or lost it on the way."""


class UnitsWarning(UserWarning):
    """A body is too large or too small for metres."""


METRES_PER_UNIT = {"millimetres": 1e-3, "centimetres": 1e-2, "inches": 0.0254, "kilometres": 1e3}
TYPICAL_SIZE = 1.7


def body_status(
    vertices: ArrayLike, template: BodyTemplate, ground: Ground, threshold: float = 0.1, contact: str = "paper"
) -> NDArray[np.int64]:
    """The `Status` bits of each body, (...,). vertices (..., V, 3) m; contact is |h| < `threshold` metres."""
    from ipman_rs import _core
    from ipman_rs.arrays import Bodies
    from ipman_rs.checks import choice, positive

    bodies = Bodies(vertices, template)
    threshold = positive("threshold", threshold)
    choice("contact", contact, Literal["paper", "released"])
    return bodies.unfold(_core.status(template._core, contact, threshold, *bodies.over(ground)))


def status_names(status: Any) -> Any:
    """The names of the bits that are set, such as ["NO_CONTACT"]; nested as the batch."""
    if np.ndim(status):
        return [status_names(one) for one in status]
    return [flag.name for flag in Status if flag and int(status) & flag]


def warn_odd_size(size: float, what: str) -> None:
    """Warns if `size`, the longest side of a body's bounding box, is not that of a person in metres."""
    if 0.2 <= size <= 10.0 or not math.isfinite(size) or size == 0.0:
        return

    def misfit(unit: str) -> float:
        return abs(math.log(size * METRES_PER_UNIT[unit] / TYPICAL_SIZE))

    unit = min(METRES_PER_UNIT, key=misfit)
    warnings.warn(
        f"{what} is {size:.4g} m across; is it in {unit}? Multiply the vertices by {METRES_PER_UNIT[unit]:g}",
        UnitsWarning,
        stacklevel=3,
    )
