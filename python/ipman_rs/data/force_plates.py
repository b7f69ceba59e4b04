"""Force plates: forces, and the centre of pressure computed from the raw forces and moments of a `.c3d` file.

Expected: a `.c3d` file, or a folder of them, with POINT (markers, in the unit that UNITS says, the vertical axis that
Y_SCREEN says, z without it) and FORCE_PLATFORM (TYPE 2 or 4 with six channels Fx, Fy, Fz, Mx, My, Mz, or TYPE 3 with
the eight of a Kistler plate; CORNERS, ORIGIN, CHANNEL) over ANALOG, in N and N mm or N m. Such files come from any
motion capture laboratory. Frames have the file's axes and the rate of its points; `joints` are its markers, the ground
is the plates' surface (the axis' zero without plates). No cameras. Needs the extra `c3d`.
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
from .check import Finding, demanded
from .frames import DataSet, Frames
from .joined import Joined
from .tracks import METRES, TO_Y_UP

NAME = "force-plates"

Array = NDArray[np.float64]

LOADED = 20.0  # N: with less, a plate's centre of pressure is noise
LEVEL = 0.7  # cosine: of several plates, one at least lies level; others may be ramps or walls
UP = {axis: TO_Y_UP[axis].T @ (0.0, 1.0, 0.0) for axis in TO_Y_UP}
CHANNELS = {2: 6, 3: 8, 4: 6}  # of a plate, by its type
NEWTON_METRES = {"nmm": 1e-3, "n.mm": 1e-3, "n*mm": 1e-3, "ncm": 1e-2, "nm": 1.0, "n.m": 1.0, "n*m": 1.0}


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
    surface, the plane of its corners. A baseline (FORCE_PLATFORM:ZERO) is not subtracted. ImportError without the
    extra. ValueError, naming the file, for whatever is missing, damaged or of an unknown type.
    """
    return of_recording(c3d.read(Path(path)), up)


def of_recording(found: c3d.Recording, up: str | None = None) -> ForcePlates:
    """As `read`."""
    used = int((found.values("FORCE_PLATFORM", "USED") or [0])[0])
    if used == 0:
        raise ValueError(f"{found.source}: expected force plates (FORCE_PLATFORM), it has none")
    if (up or found.up) not in UP:
        raise ValueError(f"{found.source}: up: expected x, y or z, got {up or found.up!r}")
    vertical = UP[up or found.up]
    plates = [_Plate.of(found, index) for index in range(used)]
    normals = np.abs([plate.axes[:, 2] for plate in plates])
    if (normals @ np.abs(vertical)).max() < LEVEL:
        axis = "xyz"[int(normals[0].argmax())]
        raise ValueError(
            f"{found.source}: looks like {axis} up: that is where its force plates face, up is said to be "
            f"{up or found.up}; say up={axis!r} if so"
        )
    wrenches = [plate.wrench(vertical) for plate in plates]
    forces, points, moments = (np.stack(part, axis=1) for part in zip(*wrenches, strict=True))
    count = len(found.analogs) // max(len(found.times), 1)
    if count == 0:
        raise ValueError(f"{found.source}: expected samples of the force plates, it has none")
    rate = found.rate * count if found.rate > 0 else float(count)
    times = found.times[0] + np.arange(len(found.analogs)) / rate
    corners = np.stack([plate.corners for plate in plates])
    return ForcePlates(times, forces, points, moments, vertical, found.source, corners)


@dataclass(frozen=True, eq=False)
class _Plate:
    """A plate's own numbers: axes x and y along its edges, z = x × y (down), about its transducer's origin."""

    place: str  # file and number, for errors
    corners: Array  # (4, 3) m, in the world: at +x +y, -x +y, -x -y, +x -y
    origin: Array  # (3,) m, from the transducer to the middle of the surface, in the plate's axes
    forces: Array  # (T, 3) N
    moments: Array  # (T, 3) N m

    @classmethod
    def of(cls, found: c3d.Recording, index: int) -> _Plate:
        place = f"{found.source}: force plate {index + 1}"
        kind = _of_plate(found, "TYPE", index, 1)
        if not kind or int(kind[0]) not in CHANNELS:
            got = f"type {int(kind[0])}" if kind else "none"
            raise ValueError(f"{place}: TYPE: expected one of {', '.join(map(str, CHANNELS))}, got {got}")
        scale = METRES.get(found.unit.lower())
        if scale is None:
            raise ValueError(f"{place}: units: expected one of {', '.join(METRES)}, got {found.unit!r}")
        corners = np.array(_of_plate(found, "CORNERS", index, 12), float)
        origin = np.array(_of_plate(found, "ORIGIN", index, 3), float)
        for name, got, size in (("CORNERS", corners, 12), ("ORIGIN", origin, 3)):
            if got.size != size or not np.isfinite(got).all():
                raise ValueError(f"{place}: {name}: expected {size} numbers, got {got.size}")
        signals = _signals(found, index, int(kind[0]), place)
        forces, moments = _kistler(signals, origin * scale) if int(kind[0]) == 3 else (signals[:, :3], signals[:, 3:])
        # The sensors lie under the surface and z points down, but many files have the vector the other way round.
        origin = -origin * scale if origin[2] > 0 else origin * scale
        if int(kind[0]) == 3:
            origin = np.array([0.0, 0.0, origin[2]])
        return cls(place, corners.reshape(4, 3) * scale, origin, forces, moments)

    def wrench(self, up: Array) -> tuple[Array, Array, Array]:
        """Force on the body, centre of pressure and moment about it, each (T, 3), in the world."""
        axes = self.axes
        forces = self.forces
        moments = self.moments - np.cross(self.origin, forces)  # about the middle of the surface
        with np.errstate(divide="ignore", invalid="ignore"):
            x, y = -moments[:, 1] / forces[:, 2], moments[:, 0] / forces[:, 2]
        free = moments[:, 2] - x * forces[:, 1] + y * forces[:, 0]
        points = self.corners.mean(axis=0) + np.stack([x, y], axis=1) @ axes[:, :2].T
        force, moment = forces @ axes.T, free[:, None] * axes[:, 2]
        # Some systems write the force on the plate, others that on the body. Nobody pulls at a plate.
        loads = force @ up
        sign = -1.0 if loads.size and -loads.min() > max(loads.max(), LOADED) else 1.0
        return sign * force, np.where(np.isfinite(points), points, np.nan), sign * np.nan_to_num(moment)

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


def _of_plate(found: c3d.Recording, name: str, index: int, size: int) -> list[float]:
    """The numbers of one plate of a parameter whose last dimension is the plates."""
    return found.values("FORCE_PLATFORM", name)[index * size : (index + 1) * size]


def _signals(found: c3d.Recording, index: int, kind: int, place: str) -> Array:
    """(T, 6 or 8) forces in N and moments in N m, or forces alone, in the plate's axes."""
    count = CHANNELS[kind]
    stored = len(found.values("FORCE_PLATFORM", "CHANNEL")) // max(len(found.values("FORCE_PLATFORM", "TYPE")), 1)
    channels = [int(number) - 1 for number in _of_plate(found, "CHANNEL", index, stored)[:count]]
    if len(channels) < count or min(channels) < 0 or max(channels) >= found.analogs.shape[1]:
        raise ValueError(
            f"{place}: CHANNEL: expected {count} of the {found.analogs.shape[1]} channels, got "
            f"{', '.join(str(channel + 1) for channel in channels) or 'none'}"
        )
    signals = found.analogs[:, channels]
    units = [str(unit).strip().lower() for unit in found.values("ANALOG", "UNITS")]
    units = ["" if channel >= len(units) else units[channel] for channel in channels]
    if kind == 4:  # raw channels, turned into forces and moments by a matrix
        matrix = np.array(_of_plate(found, "CAL_MATRIX", index, 36), float)
        if matrix.size != 36:
            raise ValueError(f"{place}: CAL_MATRIX: expected 36 numbers, got {matrix.size}")
        signals, units = signals @ matrix.reshape(6, 6), [""] * 6
    return signals * [_scale(unit, channel >= 3 and kind != 3, found.unit, place) for channel, unit in enumerate(units)]


def _scale(unit: str, moment: bool, length: str, place: str) -> float:
    """What makes N or N m of a channel; moments without a unit go with the points'."""
    if not moment:
        if unit in ("", "n"):
            return 1.0
    elif unit in NEWTON_METRES:
        return NEWTON_METRES[unit]
    elif unit == "":
        return METRES[length.lower()]
    expected = f"one of {', '.join(NEWTON_METRES)}" if moment else "N"
    raise ValueError(f"{place}: ANALOG:UNITS: expected {expected}, got {unit!r}: is the plate calibrated?")


def _kistler(signals: Array, origin: Array) -> tuple[Array, Array]:
    """Forces and moments of eight channels: fx12, fx34, fy14, fy23, and fz of the sensors 1 to 4 at (±a, ±b)."""
    x12, x34, y14, y23, z1, z2, z3, z4 = signals.T
    a, b = np.abs(origin[:2])
    forces = np.stack([x12 + x34, y14 + y23, z1 + z2 + z3 + z4], axis=1)
    moments = np.stack([b * (z1 + z2 - z3 - z4), a * (-z1 + z2 + z3 - z4), b * (x34 - x12) + a * (y14 - y23)], axis=1)
    return forces, moments


def open(path: str | os.PathLike[str], split: str | None = None, *, up: str | None = None) -> DataSet:
    """Markers and forces of a `.c3d` file, or of all those in a folder, a sequence each. There are no splits.

    Raises ImportError without the extra, ValueError naming the file for what is missing, damaged, or in units or axes
    that cannot be.
    """
    if split is not None:
        raise ValueError(f"split: recordings have none, got {split!r}")
    files = sequences.recordings(path, ".c3d")
    recordings = [c3d.read(file) for file in files]
    names = list(dict.fromkeys(name for found in recordings for name in found.names))

    parts = [of_file(found, file.stem, names, up) for file, found in zip(files, recordings, strict=True)]
    return demanded(Path(path), Joined(sequences.measured_alike(parts)))


def of_file(found: c3d.Recording, name: str, markers: Sequence[str], up: str | None = None) -> Frames:
    """The frames of a recording, with these markers (NaN where it has none of the name)."""
    axis = up or found.up
    if axis not in UP:
        raise ValueError(f"{found.source}: up: expected x, y or z, got {axis!r}")
    joints = np.full((len(found.times), len(markers), 3), np.nan)
    if found.names:
        column = {marker: index for index, marker in enumerate(markers)}
        joints[:, [column[marker] for marker in found.names]] = found.positions(found.names)
        joints[(joints == 0).all(axis=-1)] = np.nan  # not seen, in some systems' files
    plates = of_recording(found, up) if found.values("FORCE_PLATFORM", "USED")[:1] not in ([], [0]) else None
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
            points = content.positions(content.names)
            seen = np.isfinite(points).all(axis=-1) & (points != 0).any(axis=-1)
            found += standing(file.name, points, seen, content.up)
            found += sequences.told(file.name, open(file)[:])
            found.append(_loads(file))
        except (ValueError, ImportError) as error:
            found.append(Finding("wrong", str(error)))
    return found


def standing(what: str, markers: Array, seen: NDArray[np.bool_], up: str) -> list[Finding]:
    """Whether the way in which markers (T, M, 3) m of a person are longest, and begin at a floor, is `up`.

    Nothing is wrong in somebody who lies; so this is told, and is no error.
    """
    points = np.where(seen[..., None], markers, np.nan)[seen.sum(axis=1) > 2]
    if not len(points):
        return []
    low, high = np.nanmin(points, axis=1), np.nanmax(points, axis=1)
    extent, lowest = np.median(high - low, axis=0), np.median(low, axis=0)
    axis = int(extent.argmax())
    if "xyz"[axis] == up or extent["xyz".index(up)] > 0.8 or extent[axis] < 1.2 or not -0.3 < lowest[axis] < 0.5:
        return []
    said = f"{what}: looks like {'xyz'[axis]} up: markers reach from {lowest[axis]:.2f} m along {'xyz'[axis]} over "
    return [Finding("wrong", f"{said}{extent[axis]:.2f} m, but up is said to be {up}", "or does this person lie?")]


def _loads(file: Path) -> Finding:
    try:
        plates = read(file)
    except ValueError as error:
        return Finding("missing", str(error))
    heaviest = float(plates.loads.sum(axis=1).max())
    said = f"{file.name}: {plates.forces.shape[1]} force plates, together up to {heaviest:.0f} N"
    return Finding("ok", said) if heaviest > 200 else Finding("missing", said, "nobody stands on them")
