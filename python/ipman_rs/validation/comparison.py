"""Fitted bodies of a recording, compared with measurements."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from ipman_rs.gravity import GRAVITY
from ipman_rs.ground import Ground

from ..data.force_plates import ForcePlates
from .acceleration import CUTOFF, accelerations
from .computed import Computed, plate_loads
from .movement import LOW, SLOW, Movement, smooth
from .zero_moment_point import along_force, zero_moment_point, zero_moment_point_of_parts

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]

NEAR = 0.08  # m: a loaded plate's centre that is as near to a sole, or nearer, is under that foot
SHARED = 0.1  # of the frames with both feet down: in more, a plate that carries both has its centre between them
ANYWHERE = 0.5  # m: a reference farther from the body is in other units or axes


@dataclass(frozen=True, eq=False)
class MeasuredComparison:
    """T frames at `times`; `plates`, y up, and `reference`, a centre of mass (T, 3) m, at these times.

    NaN where nothing was measured. `seen` (T,): frames with enough visible markers to locate the body.
    `reference_name`: of its source. `standing`: mass, kg, of the person by plates on which they stood still, or NaN.

    Raises:
        ValueError: the measurements are far from the body, as in other units or axes.
    """

    name: str
    times: Array  # (T,) s
    computed: Computed
    plates: ForcePlates | None = None
    reference: Array | None = None
    seen: Mask | None = None
    reference_name: str = "reference"
    standing: float = np.nan

    def __post_init__(self) -> None:
        for what, points in (("centre of mass", self.reference), ("centre of pressure", self.measured)):
            if points is None:
                continue
            away = distances(points, self.com)
            away = away[np.isfinite(away) if self.seen is None else np.isfinite(away) & self.seen]
            if len(away) and np.median(away) > ANYWHERE:
                raise ValueError(
                    f"{self.name}: the measured {what} is {np.median(away):.2f} m beside the body fitted to the "
                    "markers; expected both in the same axes, y up, and in metres (or a file that says its units)"
                )

    @property
    def rate(self) -> float:
        """Frames a second."""
        return (len(self.times) - 1) / float(self.times[-1] - self.times[0]) if len(self.times) > 1 else 0.0

    @property
    def com(self) -> Array:
        """(T, 3) m, of the whole volume."""
        return self.computed.com["exact"]

    @cached_property
    def measured(self) -> Array | None:
        """The measured centre of pressure (T, 3) m."""
        return None if self.plates is None else self.plates.center()

    @property
    def force(self) -> Array:
        """Of all plates (T, 3) N, less what they read with nobody on them; NaN without plates."""
        if self.plates is None:
            return np.full_like(self.com, np.nan)
        return self.plates.forces.sum(axis=1) - self.unloaded

    @cached_property
    def unloaded(self) -> Array:
        """(3,) N: the median of all plates' force in the frames in which none carries a load; 0 if there are none."""
        if self.plates is None:
            return np.zeros(3)
        empty = (plate_loads(self.plates) == 0).all(axis=1) & np.isfinite(self.plates.forces).all(axis=(1, 2))
        return np.median(self.plates.forces.sum(axis=1)[empty], axis=0) if empty.any() else np.zeros(3)

    @cached_property
    def floor(self) -> Ground:
        """At the mean height of the measured centres of pressure, or of the lowest vertex of all frames."""
        if self.measured is not None and np.isfinite(self.measured).any():
            return Ground.y_up(float(np.nanmean(self.measured[:, 1])))
        return Ground.y_up(float(np.nanmin(self.computed.lowest)))

    @cached_property
    def acceleration(self) -> Array:
        """Of the centre of mass (T, 3) m/s²; NaN at both ends, and throughout if the frames are too far apart."""
        return self._accelerations(self.com)

    def _accelerations(self, points: Array) -> Array:
        return np.full_like(points, np.nan) if self.rate < 4 * CUTOFF else accelerations(points, self.rate)

    @cached_property
    def zmp(self) -> Array:
        """The zero-moment point (T, 3) m of the body's parts, each as heavy as its mean volume × 985 kg/m³."""
        centers = self.computed.part_centers
        masses = self.computed.part_masses.mean(axis=0)
        return zero_moment_point_of_parts(masses, centers, self._accelerations(centers), self.floor)

    @cached_property
    def forward(self) -> Array:
        """(T, 3): the level unit vectors along which the pelvis faces, on average over a second."""
        return smooth(self.computed.forward, round(self.rate))

    def of_person(self, vectors: Array) -> Array:
        """Vectors (T, 3) by their components forward, left and up, as the person faces."""
        left = np.cross([0.0, 1.0, 0.0], self.forward)
        return np.stack([(vectors * self.forward).sum(axis=1), (vectors * left).sum(axis=1), vectors[:, 1]], axis=1)

    @cached_property
    def lacking(self) -> Mask:
        """(T, P): plates whose force is NaN while that of another plate is not, so that their load is unknown."""
        if self.plates is None:
            return np.zeros((len(self.times), 0), bool)
        known = np.asarray(np.isfinite(self.plates.forces).all(axis=-1))
        return np.asarray(~known & known.any(axis=1, keepdims=True))

    @cached_property
    def loaded(self) -> Mask:
        """(T,): some plate carries a load, and the forces of all are known."""
        if self.measured is None:
            return np.zeros(len(self.times), bool)
        return np.isfinite(self.measured[:, 0]) & (self.lacking.sum(axis=1) == 0)

    @cached_property
    def beside(self) -> Mask:
        """(T,): `loaded`, and a foot is on the floor beside the plates: by their outlines, or, where those
        are not known, by their centres of pressure."""
        if self.plates is None or self.measured is None:
            return np.zeros(len(self.times), bool)
        if self.plates.corners is not None:
            return self.loaded & beside_plates(self.computed.soles, self.rate, self.floor, self.plates.corners)
        return self.loaded & beside_centers(self.computed, self.rate, self.floor, self.plates)

    @cached_property
    def complete(self) -> Mask:
        """(T,): the body was seen, something is loaded, all forces are known, and no foot is on the floor beside the
        plates."""
        loaded = self.loaded if self.seen is None else self.loaded & self.seen
        return loaded & ~self.beside

    @cached_property
    def kind(self) -> str:
        """The kind of movement, see `Movement.kind`."""
        visible = np.ones(len(self.times), bool) if self.seen is None or not self.seen.any() else self.seen
        paths = (self.com, self.acceleration, self.computed.soles, self.forward)
        com, acceleration, soles, forward = (path[visible] for path in paths)
        floor = float(self.floor.height)
        return Movement(com, acceleration, soles, self.computed.left, forward, floor, self.rate or 1.0).kind

    @cached_property
    def phases(self) -> Mapping[str, Mask]:
        """The complete frames; of walking, those on one plate and those on two apart; none without plates."""
        if self.plates is None:
            return {}
        if self.kind != "walking":
            return {"all": self.complete}
        count = (plate_loads(self.plates) > 0).sum(axis=1)
        return {"single support": self.complete & (count == 1), "double support": self.complete & (count == 2)}

    @cached_property
    def weights(self) -> Array:
        """Kilograms by the plates (T,): upward force / (g + acceleration), of the complete frames."""
        if self.plates is None:
            return np.full(len(self.times), np.nan)
        upward = np.nan_to_num(self.acceleration[:, 1]) if self.kind == "quiet standing" else self.acceleration[:, 1]
        return np.where(self.complete, self.force[:, 1] / (GRAVITY + upward), np.nan)

    @cached_property
    def weight(self) -> float:
        """Kilograms by the plates: mean upward force / mean of g + acceleration, over the complete frames."""
        used = np.isfinite(self.weights)
        if self.plates is None or not used.any():
            return np.nan
        upward = np.nan_to_num(self.acceleration[used, 1])
        return float(self.force[used, 1].mean() / (GRAVITY + upward.mean()))

    @property
    def mass(self) -> float:
        """The person's, kg: by plates on which they stood still, or else on which they move; NaN without plates."""
        return self.standing if np.isfinite(self.standing) else self.weight

    @cached_property
    def centers(self) -> Mapping[str, Array]:
        """Where the centre of pressure should be (T, 3) m, by name: of a body at rest, of a moving one, and by the
        paper's formula for each γ."""
        centers_by_name = {"at rest: g(CoM)": self.floor.project(self.com)}
        if self.plates is not None:
            centers_by_name["moving: ZMP of the CoM"] = zero_moment_point(self.com, self.acceleration, self.floor)
            centers_by_name["moving: ZMP of the parts"] = self.zmp
            centers_by_name["CoM along the force"] = along_force(self.com, self.force, self.floor)
        return {**centers_by_name, **{f"γ = {gamma}": points for gamma, points in self.computed.cop.items()}}


def beside_centers(computed: Computed, rate: float, floor: Ground, plates: ForcePlates) -> Mask:
    """(T,): whether a foot is on the floor and no loaded plate's centre under it, though each is under the other foot.

    A plate that carries both feet at other times, its centre under both or between them, says nothing of that.
    """
    loaded = plate_loads(plates) > 0
    soles = [computed.soles[:, side] for side in (computed.left, ~computed.left)]
    if len(loaded) < 2:
        return np.zeros(len(loaded), bool)
    away = np.stack([_nearest(plates.points, sole) for sole in soles], axis=1)
    under = (away < NEAR) & loaded[:, None]  # (T, foot, plate)
    down = np.stack([_down(sole, rate, floor).any(axis=1) for sole in soles], axis=1)
    both = np.asarray(down.all(axis=1))[:, None] & loaded  # (T, plate)
    shared = (both & (under.all(axis=1) | ~under.any(axis=1))).sum(axis=0) > SHARED * both.sum(axis=0)
    known = loaded.any(axis=1) & ~(loaded & (shared | ~under.any(axis=1))).any(axis=1)
    return np.asarray(known & (down & ~under.any(axis=2)).any(axis=1))


def _nearest(points: Array, sole: Array) -> Array:
    """How far from the points (T, P, 3) the nearest of a sole (T, n, 3) is on the floor, (T, P) m."""
    return np.linalg.norm((sole[:, :, None] - points[:, None])[..., [0, 2]], axis=-1).min(axis=1)


def _down(soles: Array, rate: float, floor: Ground) -> Mask:
    """Which points of soles (T, n, 3) are on the floor, (T, n)."""
    speed = np.linalg.norm(np.gradient(soles, 1 / rate, axis=0), axis=-1)
    return np.asarray((floor.signed_height(soles) < LOW) & (speed < SLOW))


def beside_plates(soles: Array, rate: float, floor: Ground, outlines: Array | None) -> Mask:
    """(T,): whether any point of the soles (T, n, 3) m is on the floor and within no plate's outline (P, 4, 3) m."""
    if outlines is None or len(soles) < 2:
        return np.zeros(len(soles), bool)
    on_plate = np.stack([_within(soles[..., [0, 2]], outline[:, [0, 2]]) for outline in outlines]).any(axis=0)
    return np.asarray((_down(soles, rate, floor) & ~on_plate).any(axis=1))


def _within(points: Array, outline: Array) -> Mask:
    """Whether points (..., 2) are in a convex polygon (n, 2), whichever way round."""
    edges = np.roll(outline, -1, axis=0) - outline
    away = points[..., None, :] - outline
    side = edges[:, 0] * away[..., 1] - edges[:, 1] * away[..., 0]
    return np.asarray((side >= 0).all(axis=-1) | (side <= 0).all(axis=-1))


def distances(points: Array, others: Array) -> Array:
    """On the floor (T,) m."""
    return np.linalg.norm((points - others)[:, [0, 2]], axis=1)
