"""The tip test: how firmly a rigid body stands, without a simulation, in microseconds per body.

The body stands on the hull of its vertices that are nearly as low as its lowest one. Over an edge of that hull, with
the centre of mass at height h and s inside, it must be lifted by E = m g (√(h² + s²) − h) to tip over, and the angular
velocity √(2E / I) does it, I the inertia about the edge. With the centre outside it falls like an inverted pendulum,
d(t) ≈ |s| (cosh λt − 1), λ = √(m g h / I).

The quasi-static roll goes further: on level ground the body turns over vertices and edges of its convex hull, always
downhill, until its centre of mass lies over what touches.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ipman_rs import _core
from ipman_rs.arrays import Bodies
from ipman_rs.checks import not_negative, positive
from ipman_rs.ground import Ground
from ipman_rs.quantities import densities
from ipman_rs.template import BodyTemplate

from .solids import CONTACT, Solids

FALLEN = math.radians(15.0)
"""A body whose up axis has tilted farther than this has fallen."""


@dataclass(frozen=True, eq=False)
class TipTest:
    """How firmly bodies stand; float64, in the shape of the batch.

    NaN, apart from what is known, where `status` has NON_FINITE, NO_VOLUME or NO_CONTACT (in the air).

    status: bits of `ipman_rs.Status`.
    mass (...,) kg, center_of_mass (..., 3) m and inertia (..., 3, 3) kg m² about it: exact.
    lowest: the lowest vertex above the ground, m.
    height: h, the centre of mass above the lowest vertex, m.
    margin: s, from the centre of mass to the nearest edge of what the body stands on, m; positive inside.
    barrier: the least E over the edges, J; 0 with the centre outside.
    push: the least angular velocity that tips it over an edge, rad/s; 0 with the centre outside.
    rate: λ about the nearest edge, 1/s.
    tilt: of the up axis, from the pose to where the roll comes to rest, rad, 0 to π.
    drop: potential energy that the roll sets free, J.
    nudged_tilt: the largest tilt where it comes to rest after a nudge in one of eight directions, or has fallen, rad.
    rest_margin, rest_barrier, rest_push: as margin, barrier and push, where the roll comes to rest.
    """

    status: NDArray[np.int64]
    mass: NDArray[np.float64]
    center_of_mass: NDArray[np.float64]
    inertia: NDArray[np.float64]
    lowest: NDArray[np.float64]
    height: NDArray[np.float64]
    margin: NDArray[np.float64]
    barrier: NDArray[np.float64]
    push: NDArray[np.float64]
    rate: NDArray[np.float64]
    tilt: NDArray[np.float64]
    drop: NDArray[np.float64]
    nudged_tilt: NDArray[np.float64]
    rest_margin: NDArray[np.float64]
    rest_barrier: NDArray[np.float64]
    rest_push: NDArray[np.float64]

    def stands(self, tilt: float = FALLEN) -> Any:
        """(...,) whether the roll comes to rest within so many radians, also when it is nudged. False where unknown."""
        return self.nudged_tilt <= tilt

    def displacement(self, seconds: ArrayLike) -> Any:
        """(...,) metres by which the centre of mass of a falling body has moved, as long as that is little; others 0.

        `seconds` must fit the batch.
        """
        falling = np.abs(np.minimum(self.margin, 0.0))
        return falling * (np.cosh(self.rate * np.asarray(seconds)) - 1.0)


def tip_test(
    vertices: ArrayLike,
    template: BodyTemplate,
    ground: Ground,
    density: ArrayLike = 985.0,
    tolerance: float = 0.005,
    contact: float = CONTACT,
    nudge: float = 0.001,
) -> TipTest:
    """How firmly each body stands. vertices (..., V, 3) m.

    Args:
        density: kg/m³, one for all parts or (P,).
        tolerance: the body stands on its vertices up to this height above the lowest one, m; 0 to 0.03.
        contact: a body whose lowest vertex is higher than this above the ground is in the air, m.
        nudge: a body at rest is tilted by so much in eight directions and let roll again, rad. 0.001 moves a centre of
            mass that is 1 m high by 1 mm; 0 leaves it out. Bodies that have fallen (15°) are not nudged.

    Raises:
        ValueError, TypeError: an argument of a wrong shape, kind or range.
    """
    bodies = Bodies(vertices, template)
    options = [
        positive("contact", contact), not_negative("tolerance", tolerance), not_negative("nudge", nudge), FALLEN,
    ]  # fmt: skip
    rows = _core.tip_test(template._core, densities(density, template), options, *bodies.over(ground))
    solids = Solids.of_rows(rows)
    names = (
        "height", "margin", "barrier", "push", "rate", "tilt", "drop", "nudged_tilt", "rest_margin", "rest_barrier",
        "rest_push",
    )  # fmt: skip
    return TipTest(
        status=bodies.unfold(solids.status),
        mass=bodies.unfold(solids.mass),
        center_of_mass=bodies.unfold(solids.center, 3),
        inertia=bodies.unfold(solids.inertia, 3, 3),
        lowest=bodies.unfold(solids.lowest),
        **{name: bodies.unfold(rows[:, 15 + k].copy()) for k, name in enumerate(names)},
    )
