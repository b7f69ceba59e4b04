"""What can be unusual about one body of a batch, and the warning for bodies that are not in metres."""

from __future__ import annotations

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
