"""The base of support: where the body stands, and whether its centre of mass lies over it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ipman_rs import _core, quantities
from ipman_rs.arrays import Bodies, of_each
from ipman_rs.checks import choice
from ipman_rs.ground import Ground
from ipman_rs.quantities import Contact, Method
from ipman_rs.template import BodyTemplate

Solver = Literal["hull", "lp"]


@dataclass(frozen=True, eq=False)
class BaseOfSupport:
    """The hull of the contact samples on the ground (paper, section 3.2).

    polygon: corners (K, 3) m on the ground, counter-clockwise seen from above, empty without contact; nested lists in
        the batch's shape for a batch.
    area: (...,) m².
    margin: (...,) m from the centre of mass on the ground to the polygon's boundary, positive inside, −inf without
        contact.
    inside: (...,) the paper's BoSE.
    has_contact, num_contacts: (...,).
    """

    polygon: Any
    area: NDArray[Any]
    margin: NDArray[Any]
    inside: NDArray[np.bool_]
    has_contact: NDArray[np.bool_]
    num_contacts: NDArray[np.int64]


def base_of_support(
    vertices: ArrayLike,
    template: BodyTemplate,
    ground: Ground,
    threshold: float = 0.1,
    method: Method = "pcom",
    contact: Contact = "paper",
) -> BaseOfSupport:
    """The base of support of each body. vertices (..., V, 3) m.

    Args:
        threshold: τ, m. A sample touches the ground when |h| < τ (`contact="paper"`); with `contact="released"`, as the
            authors' code has it, when h < τ, and ten contacts or fewer count as none.
        method: the centre of mass whose margin is taken.

    Raises:
        ValueError: wrong shapes, a ground that does not fit the batch, a threshold that is not positive, or an unknown
            method or contact.
        TypeError: an argument of the wrong kind, or masked vertices.
    """
    bodies = Bodies(vertices, template)
    options = quantities.support(threshold, method, contact)
    corners, counts, area, margin, num_contacts = _core.base_of_support(template._core, *options, *bodies.over(ground))
    dtype = bodies.vertices.dtype
    return BaseOfSupport(
        polygon=nest(of_each(corners.astype(dtype, copy=False), counts), bodies.shape),
        area=bodies.unfold(area.astype(dtype, copy=False)),
        margin=bodies.unfold(margin.astype(dtype, copy=False)),
        inside=bodies.unfold(margin >= 0.0),
        has_contact=bodies.unfold(num_contacts > 0),
        num_contacts=bodies.unfold(num_contacts),
    )


def support_margin(
    vertices: ArrayLike,
    template: BodyTemplate,
    ground: Ground,
    threshold: float = 0.1,
    method: Method = "pcom",
    contact: Contact = "paper",
) -> NDArray[Any]:
    """Metres from the centre of mass to the boundary of the base of support, (...,): positive inside, −inf without
    contact. A hull of zero area (one or two points, a line) has no inside: minus the distance to it.

    Raises:
        As `base_of_support`.
    """
    return Bodies(vertices, template).evaluate(quantities.support_margin(threshold, method, contact), ground)


def bose(
    vertices: ArrayLike,
    template: BodyTemplate,
    ground: Ground,
    threshold: float = 0.1,
    method: Solver = "hull",
    com_method: Method = "pcom",
    contact: Contact = "paper",
) -> NDArray[np.bool_]:
    """The paper's BoSE (Eq. 10) for each body, (...,) bool: does the centre of mass lie over the base of support?

    `hull` tests the convex hull; `lp` solves the paper's linear programme. They agree wherever |margin| > 1e-9 m.

    Raises:
        As `base_of_support`; ValueError also for an unknown method.
    """
    if choice("method", method, Solver) == "hull":
        return base_of_support(vertices, template, ground, threshold, com_method, contact).inside
    bodies = Bodies(vertices, template)
    options = quantities.support(threshold, com_method, contact, name="com_method")
    return bodies.unfold(_core.bose_lp(template._core, *options, *bodies.over(ground)))


def nest(items: list[Any], shape: tuple[int, ...]) -> Any:
    """The items as nested lists of this shape."""
    if not shape:
        return items[0]
    if len(shape) == 1:
        return items
    step = int(np.prod(shape[1:]))
    return [nest(items[start * step : (start + 1) * step], shape[1:]) for start in range(shape[0])]
