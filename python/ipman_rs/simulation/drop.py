"""The input of an engine: one body to be dropped, and the same with z up for engines with axes of their own."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ipman_rs.ground import Ground

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Drop:
    """One body: corners `points` (K, 3) of its hull from its centre of mass, mass, inertia (3, 3) about the centre, the
    centre (3,) in the world, and its ground: normal (3,) and height."""

    points: Array
    mass: float
    inertia: Array
    center: Array
    normal: Array
    height: float
    snap: bool

    def axes(self) -> Array:
        """(3, 3) rows: the axes of a frame whose z is up and whose origin is on the ground under the centre of mass."""
        return np.stack([*Ground(self.normal).axes(), self.normal])

    def standing(self) -> float:
        """The centre's height above the ground with the lowest point on it."""
        return float(-(self.points @ self.normal).min())

    def start_height(self) -> float:
        """The height above the ground at which the centre is let go."""
        return self.standing() if self.snap else float(self.center @ self.normal - self.height)


@dataclass(frozen=True, eq=False)
class UprightDrop:
    """The same with z up and the ground at z = 0: points (K, 3), inertia (3, 3), the start (3,) of the centre."""

    points: Array
    mass: float
    inertia: Array
    start: Array

    @classmethod
    def of(cls, drop: Drop) -> UprightDrop:
        axes = drop.axes()
        start = np.array([0.0, 0.0, drop.start_height()])
        return cls(drop.points @ axes.T, drop.mass, axes @ drop.inertia @ axes.T, start)
