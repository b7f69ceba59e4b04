"""The kind of a recorded movement: standing, walking, running, a jump, or movement in place."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..gravity import GRAVITY

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]

STILL = 0.015  # m: rms of the centre of mass, and of each foot, about its mean, of somebody who stands
LOW, SLOW = 0.03, 0.5  # m, m/s: what is on the floor is lower and slower
STEP = 0.12  # m: as far one foot goes before the other, of somebody who walks
TRAVEL = 0.5  # m of the centre of mass, of somebody who goes somewhere
PACE = 0.3  # m/s: faster, a foot goes forwards or backwards under the body
STANCE = 0.8  # of the time in which a foot goes backwards it is down, of somebody who walks on a treadmill
FALLS = -0.5 * GRAVITY  # m/s²: less is the upward acceleration of somebody in the air, after the low pass
FLIGHT = 0.08  # s: as long at least somebody is in the air who runs or jumps


@dataclass(frozen=True, eq=False)
class Movement:
    """Of T frames, y up: the centre of mass and its acceleration (T, 3), the vertices of both soles (T, n, 3), those of
    the `left` one (n,), and level unit vectors (T, 3) along which the person faces; `floor`: its height."""

    com: Array
    acceleration: Array
    soles: Array
    left: Mask
    forward: Array
    floor: float
    rate: float

    @property
    def kind(self) -> str:
        """ "quiet standing", "walking", "running", "jump" or "movement in place", by the paths of body and feet."""
        goes = self.strides and (self.travel > TRAVEL or self.stance > STANCE)
        if self.flies:
            return "running" if goes else "jump"
        if goes:
            return "walking"
        return "quiet standing" if self.rests else "movement in place"

    @property
    def rests(self) -> bool:
        """Whether the centre of mass stays where it is, and the feet."""
        feet = (self.soles[:, side].mean(axis=1) for side in (self.left, ~self.left))
        return all(np.sqrt(np.nanvar(points, axis=0).sum()) < STILL for points in (self.com, *feet))

    @property
    def travel(self) -> float:
        """How far apart on the floor the body is at most from where it was first, m."""
        away = (self.com - self.com[0])[:, [0, 2]]
        return float(np.linalg.norm(away, axis=1).max())

    @property
    def ahead(self) -> Array:
        """How far the left foot and the right one (T, 2) are before the body, m."""
        feet = (self.soles[:, side].mean(axis=1) for side in (self.left, ~self.left))
        return np.stack([((foot - self.com) * self.forward).sum(axis=1) for foot in feet], axis=1)

    @property
    def strides(self) -> bool:
        """Whether each foot is once a step before the other."""
        apart = self.ahead[:, 0] - self.ahead[:, 1]
        return bool(apart.max() > STEP and apart.min() < -STEP)

    @property
    def heights(self) -> Array:
        """Of the lowest point of the left foot and the right one (T, 2) above the floor, m."""
        lowest = (self.soles[:, side, 1].min(axis=1) for side in (self.left, ~self.left))
        return np.stack([*lowest], axis=1) - self.floor

    @property
    def stance(self) -> float:
        """In which part of the time in which a foot goes backwards under the body it is as low as the other one."""
        if len(self.com) < 3:
            return 0.0
        back = np.gradient(self.ahead, 1 / self.rate, axis=0) < -PACE
        low = self.heights < self.heights.min(axis=1, keepdims=True) + LOW
        return float(low[back].mean()) if back.any() else 0.0

    @property
    def flies(self) -> bool:
        """Whether both feet are off the floor and the body falls, or, where frames are too far apart for accelerations,
        is off the floor between two contacts."""
        off = (self.heights > LOW).all(axis=1)
        falls = self.acceleration[:, 1]
        if np.isfinite(falls).any():
            return longest_run(off & (np.nan_to_num(falls) < FALLS)) >= FLIGHT * self.rate
        contacts = np.flatnonzero(~off)
        far = np.asarray((self.heights > 3 * LOW).all(axis=1))
        return len(contacts) > 1 and bool(far[contacts[0] : contacts[-1]].any())


def longest_run(mask: Mask) -> int:
    """The most frames in a row in which it is true."""
    edges = np.flatnonzero(np.diff(np.concatenate([[0], mask.astype(np.int8), [0]])))
    return int((edges[1::2] - edges[::2]).max()) if len(edges) else 0


def smooth(ways: Array, width: int) -> Array:
    """Level unit vectors (T, 3) after a moving mean over that many frames."""
    half = max(0, min(width, len(ways)) // 2)
    total = np.cumsum(np.concatenate([np.zeros((1, 3)), ways]), axis=0)
    rows = np.arange(len(ways))
    mean = total[np.minimum(rows + half + 1, len(ways))] - total[np.maximum(rows - half, 0)]
    length = np.linalg.norm(mean, axis=1, keepdims=True)
    return np.where(length > 1e-9, mean / np.where(length > 1e-9, length, 1.0), ways)
