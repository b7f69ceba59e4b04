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
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ipman_rs.ground import Ground

from . import c3d, sequences
from .c3d_plates import LOADED, usable_plates, whole_numbers
from .check import Finding, require_plausible
from .frames import DataSet, Frames
from .joined import Joined
from .tracks import TO_Y_UP, visibility

NAME = "force-plates"

Array = NDArray[np.float64]

HEAVIEST = 1e4  # N: all plates together read less, also of somebody who lands
LEVEL = 0.7  # cosine: of several plates, one at least lies level; others may be ramps or walls
UP = {axis: TO_Y_UP[axis].T @ (0.0, 1.0, 0.0) for axis in TO_Y_UP}


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
        carried = interpolate(self.times, loads[..., None], wanted)
        pressed = np.where(loads[..., None] > 0, loads[..., None] * self.points, 0.0)
        weighted = interpolate(self.times, pressed, wanted)
        with np.errstate(invalid="ignore"):
            points = np.where(carried > 0, weighted / carried, np.nan)
        forces, moments = (interpolate(self.times, values, wanted) for values in (self.forces, self.moments))
        return replace(self, times=wanted, forces=forces, points=points, moments=moments)

    def turned(self, rotation: ArrayLike) -> ForcePlates:
        """In other axes: every vector v becomes `rotation` @ v. `tracks.TO_Y_UP` has those that lead to y up."""
        turn = np.asarray(rotation, float).T
        return replace(
            self, forces=self.forces @ turn, points=self.points @ turn, moments=self.moments @ turn, up=self.up @ turn,
            corners=None if self.corners is None else self.corners @ turn,
        )  # fmt: skip


def drop_unreadable_plates(plates: ForcePlates) -> ForcePlates:
    """Without plates whose forces are all NaN. Notes name these, plates with missing samples, and implausible loads."""
    known = np.asarray(np.isfinite(plates.forces).all(axis=-1))  # (T, P)
    readable = np.asarray(known.any(axis=0))
    if not readable.any():
        return plates
    notes = [f"the forces of plate {plate + 1} are no numbers: it is left out" for plate in np.flatnonzero(~readable)]
    notes += [
        f"the forces of plate {plate + 1} are no numbers in {(~known[:, plate]).sum()} of {len(plates)} samples"
        for plate in np.flatnonzero(readable & ~known.all(axis=0))
    ]
    most = float(np.abs(np.nansum(plates.loads, axis=1)).max())
    if most > HEAVIEST:
        notes.append(f"loads of up to {most:.0f} N, of a person expected up to {HEAVIEST:.0f} N: are they in newtons?")
    parts = {name: getattr(plates, name)[:, readable] for name in ("forces", "points", "moments")}
    corners = None if plates.corners is None else plates.corners[readable]
    return replace(plates, **parts, corners=corners, notes=(*plates.notes, *notes))


def interpolate(times: Array, values: Array, wanted: ArrayLike) -> Array:
    """Values (T, ...) at other times (n,), on straight lines between the samples: (n, ...).

    NaN more than half a sample outside the recording: files round their times.
    """
    wanted, rows = np.asarray(wanted, float), values.reshape(len(values), -1)
    slack = 0.5 * float(np.median(np.diff(times))) if len(times) > 1 else 0.0
    outside = (wanted < times[0] - slack) | (wanted > times[-1] + slack)
    result = np.stack([np.interp(wanted, times, column) for column in rows.T], axis=-1)
    result[outside] = np.nan
    return result.astype(np.float64).reshape(len(wanted), *values.shape[1:])


def read(path: str | os.PathLike[str], up: str | None = None) -> ForcePlates:
    """The force plates of a `.c3d` file in its axes, metres and newtons, at the rate of its analogue channels.

    `up`: which axis of the file is up, if it does not say so rightly. The centre of pressure lies on the plate's
    surface, the plane of its corners. A baseline (FORCE_PLATFORM:ZERO) is not subtracted. A plate that cannot be
    computed is left out, `notes` say why. ValueError, naming the file, if it is damaged or no plate can be computed.
    """
    return from_c3d(c3d.read(Path(path)), up)


def from_c3d(file: c3d.C3DFile, up: str | None = None) -> ForcePlates:
    """The force plates of a C3D file that has been read; see `read`."""
    used = (whole_numbers(file, "USED") or [0])[0]
    if used < 1:
        raise ValueError(f"{file.source}: expected force plates (FORCE_PLATFORM), it has none")
    if (up or file.up) not in UP:
        raise ValueError(f"{file.source}: up: expected x, y or z, got {up or file.up!r}")
    vertical = UP[up or file.up]
    count = len(file.analogs) // max(len(file.times), 1)
    if count == 0:
        raise ValueError(f"{file.source}: expected samples of the force plates, it has none")
    plates, notes = usable_plates(file, used)
    normals = np.abs([plate.axes[:, 2] for plate in plates])
    if (normals @ np.abs(vertical)).max() < LEVEL:
        axis = "xyz"[int(normals[0].argmax())]
        raise ValueError(
            f"{file.source}: looks like {axis} up: that is where its force plates face, up is said to be "
            f"{up or file.up}; say up={axis!r} if so"
        )
    wrenches = [plate.wrench(vertical) for plate in plates]
    forces, points, moments = (np.stack(part, axis=1) for part in zip(*wrenches, strict=True))
    rate = file.rate * count if file.rate > 0 else float(count)
    times = file.times[0] + np.arange(len(file.analogs)) / rate
    corners = np.stack([plate.corners for plate in plates])
    return drop_unreadable_plates(ForcePlates(times, forces, points, moments, vertical, file.source, corners, notes))


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
    names = list(dict.fromkeys(name for file_content in recordings for name in file_content.markers(subject).names))
    parts = [
        frames_from_c3d(file_content, file.stem, names, up, subject)
        for file, file_content in zip(files, recordings, strict=True)
    ]
    return require_plausible(Path(path), Joined(sequences.fill_missing(parts)))


def frames_from_c3d(
    file: c3d.C3DFile, name: str, markers: Sequence[str], up: str | None = None, subject: str | None = None
) -> Frames:
    """The frames of a recording, with these markers (NaN where it has none of the name)."""
    axis = up or file.up
    if axis not in UP:
        raise ValueError(f"{file.source}: up: expected x, y or z, got {axis!r}")
    joints = np.full((len(file.times), len(markers), 3), np.nan)
    own = file.markers(subject)
    if own.names:
        column = {marker: index for index, marker in enumerate(markers)}
        visible, _ = visibility(file.points[:, own.columns], own.names)
        places = np.where(visible[..., None], file.places(own.columns), np.nan)
        joints[:, [column[marker] for marker in own.names]] = places
    plates = from_c3d(file, up) if file.has_plates else None
    return _frames(name, file, joints, list(markers), plates, UP[axis])


def _frames(
    name: str, file: c3d.C3DFile, joints: Array, markers: list[str], plates: ForcePlates | None, up: Array
) -> Frames:
    at = None if plates is None else plates.at(file.times)
    height = 0.0 if plates is None or plates.corners is None else float((plates.corners @ up).mean())
    return Frames(
        names=sequences.frame_names(name, len(file.times)),
        sequences=np.full(len(file.times), name),
        ground=Ground(up, height),
        frame_rate=file.rate or None,
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
    findings = [Finding("ok", f"{len(files)} .c3d {'file' if len(files) == 1 else 'files'}")]
    for file in files:
        try:
            content = c3d.read(file)
            own = content.markers()
            visible, notes = visibility(content.points[:, own.columns], own.names)
            findings += check_longest_axis(file.name, content.places(own.columns), visible, content.up)
            findings += [Finding("odd", f"{file.name}: {note}") for note in (*content.notes, *own.notes, *notes)]
            findings += _outputs(file, content)
            findings += sequences.check_recording(file.name, open(file)[:])
            findings += _loads(file, content.notes)
        except ValueError as error:
            findings.append(Finding("wrong", str(error)))
    return findings


def _outputs(file: Path, content: c3d.C3DFile) -> list[Finding]:
    """What a model has computed, which is not taken as markers."""
    count = len(content.outputs)
    if not count:
        return []
    com = "" if content.center_of_mass() is None else ", its centre of mass is a reference"
    return [Finding("ok", f"{file.name}: {count} outputs of a model are no markers{com}")]


def check_longest_axis(what: str, markers: Array, visible: NDArray[np.bool_], up: str) -> list[Finding]:
    """Whether the way in which markers (T, M, 3) m of a person are longest, and begin at a floor, is `up`.

    Nothing is wrong in somebody who lies; so this is told, and is no error.
    """
    points = np.where(visible[..., None], markers, np.nan)[visible.sum(axis=1) > 2]
    if not len(points):
        return []
    low, high = np.nanmin(points, axis=1), np.nanmax(points, axis=1)
    extent, lowest = np.median(high - low, axis=0), np.median(low, axis=0)
    longest = int(extent.argmax())
    axis = "xyz"[longest]
    if axis == up or extent["xyz".index(up)] > 0.8 or extent[longest] < 1.2 or not -0.3 < lowest[longest] < 0.5:
        return []
    reach = f"from {lowest[longest]:.2f} m along {axis} over {extent[longest]:.2f} m"
    message = f"{what}: looks like {axis} up: markers reach {reach}, but up is said to be {up}"
    return [Finding("wrong", message, "or does this person lie?", f"`up={axis!r}`")]


def _loads(file: Path, of_points: Sequence[str]) -> list[Finding]:
    """What the plates measured; of the notes those that are not notes `of_points`."""
    try:
        plates = read(file)
    except ValueError as error:
        return [Finding("missing", str(error))]
    findings = [Finding("odd", f"{file.name}: {note}") for note in plates.notes if note not in of_points]
    heaviest = float(np.nan_to_num(plates.loads).sum(axis=1).max())
    message = f"{file.name}: {plates.forces.shape[1]} force plates, together up to {heaviest:.0f} N"
    return [
        *findings,
        Finding("ok", message) if heaviest > 200 else Finding("missing", message, "nobody stands on them"),
    ]
