"""Force plates: forces, and the centre of pressure computed from the raw forces and moments of a `.c3d` file.

Expected: a `.c3d` file, or a folder of them, with POINT (markers, in the unit that UNITS says, the vertical axis that
Y_SCREEN says, without it the one that the plates face, or z) and FORCE_PLATFORM over ANALOG, in N and N mm or N m (in
any spelling). Plates of these types are computed (CORNERS, ORIGIN, CHANNEL), others left out with a note:

1  Fx, Fy, Fz, the centre of pressure Px, Py, and the free moment Mz (BTS, EMS)
2  Fx, Fy, Fz, Mx, My, Mz (AMTI, Bertec; all that Vicon Nexus and Qualisys write)
3  the eight channels of a Kistler plate
4  as 2, raw, with a matrix CAL_MATRIX

Such files come from any motion capture laboratory. Frames have the file's axes and the rate of its points; `joints` are
its markers (without points without a name and what models computed), the ground is the plates' surface (the axis' zero
without plates). No cameras.
"""

from __future__ import annotations

import os
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ipman_rs.ground import Ground

from . import c3d, sequences
from .c3d_format import several
from .check import Finding, demanded, size_of_body
from .frames import DataSet, Frames
from .joined import Joined
from .tracks import TO_Y_UP, not_given, seen_of
from .units import metres, newton_metres, newtons

NAME = "force-plates"

Array = NDArray[np.float64]

LOADED = 20.0  # N: with less, a plate's centre of pressure is noise
MOST = 64  # plates
HEAVY = 200.0  # N: of such a load the centre of pressure is known well
HEAVIEST = 1e4  # N: all plates together read less, also of somebody who lands
SHORTEST, LONGEST = 0.05, 4.0  # m: sides of a plate
LEVEL = 0.7  # cosine: of several plates, one at least lies level; others may be ramps or walls
UP = {axis: TO_Y_UP[axis].T @ (0.0, 1.0, 0.0) for axis in TO_Y_UP}
CHANNELS = {1: 6, 2: 6, 3: 8, 4: 6}  # of a plate, by its type
OTHER_TYPES = {  # what they are, for whoever has one
    5: "eight channels with a matrix",
    6: "twelve channels with a matrix",
    7: "a Kistler plate with a matrix",
    11: "Kistler's treadmill",
    12: "Kistler's treadmill with two belts",
    21: "AMTI's stairs",
}


@dataclass(frozen=True, eq=False)
class ForcePlates:
    """P plates in T samples. Forces act on the body.

    A plate's centre of pressure is meaningless while it carries next to no load: whatever its numbers say, or NaN.
    """

    times: Array  # (T,) s
    forces: Array  # (T, P, 3) N
    points: Array  # (T, P, 3) m, centres of pressure on the plates
    moments: Array  # (T, P, 3) N m, about the centres of pressure
    up: Array  # (3,) unit vector
    source: str
    corners: Array | None = None  # (P, 4, 3) m
    notes: tuple[str, ...] = ()  # what of the file was left out or turned, a sentence each

    def __len__(self) -> int:
        return len(self.times)

    @property
    def loads(self) -> Array:
        """(T, P) N upwards."""
        return self.forces @ self.up

    def center(self, least: float = LOADED) -> Array:
        """The centre of pressure of all plates (T, 3) m: the mean, by load, of those that carry more than `least` N.

        NaN where none does.
        """
        loads = np.where((self.loads > least) & np.isfinite(self.points).all(axis=-1), self.loads, 0.0)
        together = loads.sum(axis=1)
        weighted = np.einsum("tp,tpk->tk", loads, np.where(loads[..., None] > 0, self.points, 0.0))
        with np.errstate(invalid="ignore"):
            return np.where(together[:, None] > 0, weighted / together[:, None], np.nan)

    def at(self, times: ArrayLike, least: float = LOADED) -> ForcePlates:
        """What the plates measured at other times, on straight lines between the samples; NaN outside them.

        Not the points are joined but loads times points, of plates that carry more than `least` N: next to a sample
        without a load the point stays where the load is.
        """
        wanted = np.asarray(times, float)
        loads = np.where((self.loads > least) & np.isfinite(self.points).all(axis=-1), self.loads, 0.0)
        carried = between(self.times, loads[..., None], wanted)
        pressed = np.where(loads[..., None] > 0, loads[..., None] * self.points, 0.0)
        weighted = between(self.times, pressed, wanted)
        with np.errstate(invalid="ignore"):
            points = np.where(carried > 0, weighted / carried, np.nan)
        forces, moments = (between(self.times, values, wanted) for values in (self.forces, self.moments))
        return replace(self, times=wanted, forces=forces, points=points, moments=moments)

    def turned(self, rotation: ArrayLike) -> ForcePlates:
        """In other axes: every vector v becomes `rotation` @ v. `tracks.TO_Y_UP` has those that lead to y up."""
        turn = np.asarray(rotation, float).T
        return replace(
            self, forces=self.forces @ turn, points=self.points @ turn, moments=self.moments @ turn, up=self.up @ turn,
            corners=None if self.corners is None else self.corners @ turn,
        )  # fmt: skip


def recorded(found: ForcePlates) -> ForcePlates:
    """Without the plates of which no force is a number; notes name them, those that lack some samples, and a load that
    is nobody's."""
    known = np.asarray(np.isfinite(found.forces).all(axis=-1))  # (T, P)
    kept = np.asarray(known.any(axis=0))
    if not kept.any():
        return found
    notes = [f"the forces of plate {plate + 1} are no numbers: it is left out" for plate in np.flatnonzero(~kept)]
    notes += [
        f"the forces of plate {plate + 1} are no numbers in {(~known[:, plate]).sum()} of {len(found)} samples"
        for plate in np.flatnonzero(kept & ~known.all(axis=0))
    ]
    most = float(np.abs(np.nansum(found.loads, axis=1)).max())
    if most > HEAVIEST:
        notes.append(f"loads of up to {most:.0f} N, of a person expected up to {HEAVIEST:.0f} N: are they in newtons?")
    parts = {name: getattr(found, name)[:, kept] for name in ("forces", "points", "moments")}
    corners = None if found.corners is None else found.corners[kept]
    return replace(found, **parts, corners=corners, notes=(*found.notes, *notes))


def between(times: Array, values: Array, wanted: ArrayLike) -> Array:
    """Values (T, ...) at other times (n,), on straight lines between the samples: (n, ...).

    NaN more than half a sample outside the recording: files round their times.
    """
    wanted, rows = np.asarray(wanted, float), values.reshape(len(values), -1)
    slack = 0.5 * float(np.median(np.diff(times))) if len(times) > 1 else 0.0
    outside = (wanted < times[0] - slack) | (wanted > times[-1] + slack)
    found = np.stack([np.interp(wanted, times, column) for column in rows.T], axis=-1)
    found[outside] = np.nan
    return found.astype(np.float64).reshape(len(wanted), *values.shape[1:])


def read(path: str | os.PathLike[str], up: str | None = None) -> ForcePlates:
    """The force plates of a `.c3d` file in its axes, metres and newtons, at the rate of its analogue channels.

    `up`: which axis of the file is up, if it does not say so rightly. The centre of pressure lies on the plate's
    surface, the plane of its corners. A baseline (FORCE_PLATFORM:ZERO) is not subtracted. A plate that cannot be
    computed is left out, `notes` say why. ValueError, naming the file, if it is damaged or no plate can be computed.
    """
    return of_recording(c3d.read(Path(path)), up)


def of_recording(found: c3d.Recording, up: str | None = None) -> ForcePlates:
    """As `read`."""
    used = (_whole(found, "USED") or [0])[0]
    if used < 1:
        raise ValueError(f"{found.source}: expected force plates (FORCE_PLATFORM), it has none")
    if (up or found.up) not in UP:
        raise ValueError(f"{found.source}: up: expected x, y or z, got {up or found.up!r}")
    vertical = UP[up or found.up]
    count = len(found.analogs) // max(len(found.times), 1)
    if count == 0:
        raise ValueError(f"{found.source}: expected samples of the force plates, it has none")
    plates, notes = _usable(found, used)
    normals = np.abs([plate.axes[:, 2] for plate in plates])
    if (normals @ np.abs(vertical)).max() < LEVEL:
        axis = "xyz"[int(normals[0].argmax())]
        raise ValueError(
            f"{found.source}: looks like {axis} up: that is where its force plates face, up is said to be "
            f"{up or found.up}; say up={axis!r} if so"
        )
    wrenches = [plate.wrench(vertical) for plate in plates]
    forces, points, moments = (np.stack(part, axis=1) for part in zip(*wrenches, strict=True))
    rate = found.rate * count if found.rate > 0 else float(count)
    times = found.times[0] + np.arange(len(found.analogs)) / rate
    corners = np.stack([plate.corners for plate in plates])
    return recorded(ForcePlates(times, forces, points, moments, vertical, found.source, corners, notes))


def _usable(found: c3d.Recording, used: int) -> tuple[list[_Plate], tuple[str, ...]]:
    """The plates that can be computed, and what is wrong with the others. ValueError if it is something with each."""
    plates, wrong = [], []
    scale, notes = _plates_unit(found)
    notes = (*(note for note in found.notes if note == not_given(found.unit)), *notes)
    for index in range(min(used, MOST)):
        try:
            plate = _Plate.of(found, index, scale)
            _ = plate.axes  # of corners that make a plate
            notes = (*notes, *plate.astray())
            plates.append(plate)
        except ValueError as error:
            wrong.append(str(error))
    if not plates:
        raise ValueError(wrong[0])
    return plates, (*notes, *(f"{what.removeprefix(f'{found.source}: ')}; left out" for what in wrong))


def _plates_unit(found: c3d.Recording) -> tuple[float, tuple[str, ...]]:
    """Metres in the unit of corners and origins: the points', unless only the points, a person's, can be in it."""
    scale = found.metres
    values = [value for value in found.values("FORCE_PLATFORM", "CORNERS") if isinstance(value, (int, float))]
    corners = np.array(values[: len(values) // 12 * 12], float).reshape(-1, 4, 3)
    sides = np.linalg.norm(corners[:, 0] - corners[:, 1], axis=-1)
    sides = sides[np.isfinite(sides) & (sides > 0)]
    if not len(sides) or np.median(sides) * scale <= LONGEST or not SHORTEST < np.median(sides) * 1e-3 <= LONGEST:
        return scale, ()
    own = found.markers(next(iter(found.subjects), None))
    seen, _ = seen_of(found.points[:, own.columns], own.names)
    points = np.where(seen[..., None], found.places(own.columns), np.nan)
    if not seen.any() or size_of_body("points", points)[0].level != "ok":
        return scale, ()  # all are in another unit than the file says
    return 1e-3, (f"the corners of the force plates are in millimetres, its points in {found.unit}",)


@dataclass(frozen=True, eq=False)
class _Plate:
    """A plate's own numbers: axes x and y along its edges, z = x × y (down), about its transducer's origin."""

    place: str  # file and number, for errors
    corners: Array  # (4, 3) m, in the world: at +x +y, -x +y, -x -y, +x -y
    forces: Array  # (T, 3) N
    points: Array  # (T, 2) m, centres of pressure from the middle of the surface; not finite without a load
    free: Array  # (T,) N m about z at the centre of pressure
    unit: str  # of its moments, of type 1 of its centres of pressure, as the file says; "" if it does not

    @classmethod
    def of(cls, found: c3d.Recording, index: int, scale: float) -> _Plate:
        """`scale`: metres in the unit of its corners and origin."""
        place = f"{found.source}: force plate {index + 1}"
        kind = _type(found, index, place)
        corners = _numbers_of_plate(found, "CORNERS", index, 12, place).reshape(4, 3) * scale
        origin = _numbers_of_plate(found, "ORIGIN", index, 3, place) * scale
        channels = _channels(found, index, kind, place)
        units = _units(found, channels)
        signals = _signals(found, index, kind, channels, scale, place)
        if kind == 1:
            return cls(place, corners, signals[:, :3], signals[:, 3:5], signals[:, 5], units[3])
        forces, moments = _kistler(signals, origin) if kind == 3 else (signals[:, :3], signals[:, 3:])
        # The sensors lie under the surface and z points down, but many files have the vector the other way round.
        origin = -origin if origin[2] > 0 else origin
        if kind == 3:
            origin = np.array([0.0, 0.0, origin[2]])
        moments = moments - np.cross(origin, forces)  # about the middle of the surface
        with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
            x, y = -moments[:, 1] / forces[:, 2], moments[:, 0] / forces[:, 2]
            free = moments[:, 2] - x * forces[:, 1] + y * forces[:, 0]
        return cls(place, corners, forces, np.stack([x, y], axis=1), free, "" if kind == 3 else units[3])

    def astray(self) -> list[str]:
        """In words that its centre of pressure is mostly beside its corners; ValueError if it is farther from them
        than the plate is long, as in another unit."""
        heavy = np.abs(self.forces[:, 2]) > HEAVY
        first, second, third, fourth = self.corners
        half = np.linalg.norm([(first + fourth) - (second + third), (first + second) - (third + fourth)], axis=1) / 4
        with np.errstate(invalid="ignore"):
            away = np.linalg.norm(np.maximum(np.abs(self.points[heavy]) - half, 0.0), axis=1)
        away = away[np.isfinite(away)]
        middle = float(np.median(away)) if len(away) else 0.0
        if middle == 0:
            return []
        unit = f", by the file in {self.unit!r}," if self.unit.strip() else ""
        said = f"{self.place}: its centre of pressure is {middle:.3g} m outside its corners"
        if middle > 2 * np.linalg.norm(half):
            raise ValueError(f"{said}: are its moments{unit} in another unit?")
        name = said.removeprefix(self.place.rpartition(": ")[0]).removeprefix(": ")
        return [f"{name} in the median: are its corners and its origin right?"]

    def wrench(self, up: Array) -> tuple[Array, Array, Array]:
        """Force on the body, centre of pressure and moment about it, each (T, 3), in the world."""
        axes = self.axes
        with np.errstate(invalid="ignore", over="ignore"):
            points = self.corners.mean(axis=0) + self.points @ axes[:, :2].T
            force, moment = self.forces @ axes.T, self.free[:, None] * axes[:, 2]
        # Some systems write the force on the plate, others that on the body. Nobody pulls at a plate.
        loads = force @ up
        loads = loads[np.isfinite(loads)]
        sign = -1.0 if loads.size and -loads.min() > max(loads.max(), LOADED) else 1.0
        force, points = (np.where(np.isfinite(part), part, np.nan) for part in (force, points))
        return sign * force, points, sign * np.nan_to_num(moment)

    @cached_property
    def axes(self) -> Array:
        """(3, 3), the plate's axes in the world as columns."""
        first, second, third, fourth = self.corners
        x, y = (first + fourth) - (second + third), (first + second) - (third + fourth)
        z = np.cross(x, y)
        area = np.linalg.norm(z)
        if not area > 1e-3 or np.linalg.norm(x) > 4 or np.linalg.norm(y) > 4:
            sides = f"{np.linalg.norm(x) / 2:.3g} × {np.linalg.norm(y) / 2:.3g} m"
            hint = "; looks like millimetres" if area > 100 else ""
            raise ValueError(f"{self.place}: CORNERS: expected a plate of a decimetre to two metres, got {sides}{hint}")
        x, z = x / np.linalg.norm(x), z / area
        return np.stack([x, np.cross(z, x), z], axis=1).astype(np.float64)


def _type(found: c3d.Recording, index: int, place: str) -> int:
    """Which of the types that can be computed."""
    kind = next(iter(_whole(found, "TYPE")[index : index + 1]), None)
    if kind in CHANNELS:
        return kind
    expected = f"TYPE: expected one of {', '.join(map(str, CHANNELS))}"
    if kind is None:
        raise ValueError(f"{place}: {expected}, got none")
    what = f" ({OTHER_TYPES[kind]})" if kind in OTHER_TYPES else ""
    raise ValueError(
        f"{place}: {expected}, got type {kind}{what}; export its forces and moments as type 2, or as a .mot file"
    )


def _whole(found: c3d.Recording, name: str) -> list[int]:
    """The numbers of a parameter of counts; 0 for what is none."""
    values = found.values("FORCE_PLATFORM", name)
    return [int(value) if isinstance(value, (int, float)) and np.isfinite(value) else 0 for value in values]


def _numbers_of_plate(found: c3d.Recording, name: str, index: int, size: int, place: str) -> Array:
    """The numbers of one plate of a parameter whose last dimension is the plates. ValueError if some are missing."""
    values = found.values("FORCE_PLATFORM", name)[index * size : (index + 1) * size]
    got = np.array([value for value in values if isinstance(value, (int, float))], float)
    if got.size != size or not np.isfinite(got).all():
        raise ValueError(f"{place}: {name}: expected {size} numbers, got {int(np.isfinite(got).sum())}")
    return got


def _channels(found: c3d.Recording, index: int, kind: int, place: str) -> list[int]:
    """The columns of its signals. ValueError if they are too few, or not there."""
    count = CHANNELS[kind]
    stored = _whole(found, "CHANNEL")
    each = len(stored) // max(len(_whole(found, "TYPE")), 1)
    channels = [number - 1 for number in stored[index * each : (index + 1) * each][:count]]
    if len(channels) < count or min(channels) < 0 or max(channels) >= found.analogs.shape[1]:
        raise ValueError(
            f"{place}: CHANNEL: expected {count} of the {found.analogs.shape[1]} channels, got "
            f"{', '.join(str(channel + 1) for channel in channels) or 'none'}"
        )
    return channels


def _units(found: c3d.Recording, channels: Sequence[int]) -> list[str]:
    """As the file says; "" where it does not."""
    units = [str(unit) for unit in several(found.parameters.get("ANALOG", {}), "UNITS")]
    return ["" if channel >= len(units) else units[channel] for channel in channels]


def _signals(found: c3d.Recording, index: int, kind: int, channels: Sequence[int], length: float, place: str) -> Array:
    """(T, 6 or 8) forces in N and moments in N m, or forces alone, in the plate's axes."""
    signals, units = found.analogs[:, channels], _units(found, channels)
    matrix = found.values("FORCE_PLATFORM", "CAL_MATRIX")
    if kind == 4 and matrix:  # raw channels, turned into forces and moments by a matrix; Cortex leaves it empty
        matrix = _numbers_of_plate(found, "CAL_MATRIX", index, 36, place)
        with np.errstate(invalid="ignore", over="ignore"):
            signals, units = signals @ matrix.reshape(6, 6), [""] * 6
    return signals * [_scale(unit, kind, column, length, place) for column, unit in enumerate(units)]


def _scale(unit: str, kind: int, column: int, length: float, place: str) -> float:
    """What makes N, m or N m of a channel; lengths and moments without a unit go with the plate's `length`."""
    if column < 3 or kind == 3:
        expected, scale = "N", 1.0 if not unit.strip() else newtons(unit)
    elif kind == 1 and column < 5:
        # Px and Py are lengths, whatever unit of force the program gave all six channels.
        expected, scale = "mm or m", metres(unit) or (length if not unit.strip() or newtons(unit) else None)
    elif kind == 1 and newtons(unit):
        expected, scale = "N mm or N m", length
    else:
        expected, scale = "N mm or N m", length if not unit.strip() else newton_metres(unit)
    if scale is None:
        raise ValueError(f"{place}: ANALOG:UNITS: expected {expected}, got {unit!r}: is the plate calibrated?")
    return scale


def _kistler(signals: Array, origin: Array) -> tuple[Array, Array]:
    """Forces and moments of eight channels: fx12, fx34, fy14, fy23, and fz of the sensors 1 to 4 at (±a, ±b)."""
    x12, x34, y14, y23, z1, z2, z3, z4 = signals.T
    a, b = np.abs(origin[:2])
    forces = np.stack([x12 + x34, y14 + y23, z1 + z2 + z3 + z4], axis=1)
    moments = np.stack([b * (z1 + z2 - z3 - z4), a * (-z1 + z2 + z3 - z4), b * (x34 - x12) + a * (y14 - y23)], axis=1)
    return forces, moments


def open(
    path: str | os.PathLike[str], split: str | None = None, *, up: str | None = None, subject: str | None = None
) -> DataSet:
    """Markers and forces of a `.c3d` file, or of all those in a folder, a sequence each. There are no splits.

    `subject`: whose markers, where files have several people's. ValueError naming the file for what is missing,
    damaged, or in units or axes that cannot be.
    """
    if split is not None:
        raise ValueError(f"split: recordings have none, got {split!r}")
    files = sequences.recordings(path, ".c3d")
    recordings = [c3d.read(file) for file in files]
    names = list(dict.fromkeys(name for found in recordings for name in found.markers(subject).names))
    parts = [of_file(found, file.stem, names, up, subject) for file, found in zip(files, recordings, strict=True)]
    return demanded(Path(path), Joined(sequences.measured_alike(parts)))


def of_file(
    found: c3d.Recording, name: str, markers: Sequence[str], up: str | None = None, subject: str | None = None
) -> Frames:
    """The frames of a recording, with these markers (NaN where it has none of the name)."""
    axis = up or found.up
    if axis not in UP:
        raise ValueError(f"{found.source}: up: expected x, y or z, got {axis!r}")
    joints = np.full((len(found.times), len(markers), 3), np.nan)
    own = found.markers(subject)
    if own.names:
        column = {marker: index for index, marker in enumerate(markers)}
        seen, _ = seen_of(found.points[:, own.columns], own.names)
        places = np.where(seen[..., None], found.places(own.columns), np.nan)
        joints[:, [column[marker] for marker in own.names]] = places
    plates = of_recording(found, up) if found.has_plates else None
    return _frames(name, found, joints, list(markers), plates, UP[axis])


def _frames(
    name: str, found: c3d.Recording, joints: Array, markers: list[str], plates: ForcePlates | None, up: Array
) -> Frames:
    at = None if plates is None else plates.at(found.times)
    height = 0.0 if plates is None or plates.corners is None else float((plates.corners @ up).mean())
    return Frames(
        names=sequences.numbered(name, len(found.times)),
        sequences=np.full(len(found.times), name),
        ground=Ground(up, height),
        frame_rate=found.rate or None,
        joints=joints if markers else None,
        joint_names=tuple(markers) if markers else None,
        center_of_pressure=None if at is None else at.center(),
        forces=None if at is None else at.forces,
    )


def check(path: str | os.PathLike[str]) -> list[Finding]:
    """What `.c3d` files there are, which of them can be read, and whether units, axes and loads can be right."""
    try:
        files = sequences.recordings(path, ".c3d")
    except ValueError as error:
        return [Finding("missing", str(error), "expected a .c3d file or a folder of them")]
    found = [Finding("ok", f"{len(files)} .c3d {'file' if len(files) == 1 else 'files'}")]
    for file in files:
        try:
            content = c3d.read(file)
            own = content.markers()
            seen, said = seen_of(content.points[:, own.columns], own.names)
            found += standing(file.name, content.places(own.columns), seen, content.up)
            found += [Finding("odd", f"{file.name}: {note}") for note in (*content.notes, *own.notes, *said)]
            found += _outputs(file, content)
            found += sequences.told(file.name, open(file)[:])
            found += _loads(file, content.notes)
        except ValueError as error:
            found.append(Finding("wrong", str(error)))
    return found


def _outputs(file: Path, content: c3d.Recording) -> list[Finding]:
    """What a model has computed, which is not taken as markers."""
    count = len(content.outputs)
    if not count:
        return []
    com = "" if content.center_of_mass() is None else ", its centre of mass is a reference"
    return [Finding("ok", f"{file.name}: {count} outputs of a model are no markers{com}")]


def standing(what: str, markers: Array, seen: NDArray[np.bool_], up: str) -> list[Finding]:
    """Whether the way in which markers (T, M, 3) m of a person are longest, and begin at a floor, is `up`.

    Nothing is wrong in somebody who lies; so this is told, and is no error.
    """
    points = np.where(seen[..., None], markers, np.nan)[seen.sum(axis=1) > 2]
    if not len(points):
        return []
    low, high = np.nanmin(points, axis=1), np.nanmax(points, axis=1)
    extent, lowest = np.median(high - low, axis=0), np.median(low, axis=0)
    longest = int(extent.argmax())
    axis = "xyz"[longest]
    if axis == up or extent["xyz".index(up)] > 0.8 or extent[longest] < 1.2 or not -0.3 < lowest[longest] < 0.5:
        return []
    reach = f"from {lowest[longest]:.2f} m along {axis} over {extent[longest]:.2f} m"
    said = f"{what}: looks like {axis} up: markers reach {reach}, but up is said to be {up}"
    return [Finding("wrong", said, "or does this person lie?", f"--up {axis}")]


def _loads(file: Path, said: Sequence[str]) -> list[Finding]:
    """What the plates measured; of the notes those that were not `said` of the points."""
    try:
        plates = read(file)
    except ValueError as error:
        return [Finding("missing", str(error))]
    found = [Finding("odd", f"{file.name}: {note}") for note in plates.notes if note not in said]
    heaviest = float(np.nan_to_num(plates.loads).sum(axis=1).max())
    said = f"{file.name}: {plates.forces.shape[1]} force plates, together up to {heaviest:.0f} N"
    return [*found, Finding("ok", said) if heaviest > 200 else Finding("missing", said, "nobody stands on them")]
