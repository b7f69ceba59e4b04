"""OpenSim's recordings: markers in `.trc`, force plates and centres of mass in `.mot` and `.sto`.

Expected: a `.trc` file, or a folder of them, and beside it storages whose names have the marker file's name in them:
`walk.trc`, `walk_grf.mot` (ground forces), `walk_com.sto` (BodyKinematics: center_of_mass_X, Y, Z); a centre of mass
under another name belongs to the only recording with forces. OpenSim's world is
y up, right-handed, in metres; the floor is y = 0. A `.trc` says its unit; a storage does not, and its forces and points
must be N and m (`plates` takes other units). Frames have the markers' rate (often 60 or 100 Hz; force plates have
their own, and are read at the markers' times). No cameras. Such files come with OpenSim's models, SimTK projects,
OpenCap and AddBiomechanics.
"""

from __future__ import annotations

import os
import re
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ipman_rs.ground import Ground

from . import sequences, text_file, trc
from .check import Finding, demand, demanded, size_of_body
from .force_plates import LOADED, UP, ForcePlates, between, standing
from .frames import DataSet, Frames
from .joined import Joined
from .tracks import METRES, Tracks

NAME = "opensim"

Array = NDArray[np.float64]

COM = "center_of_mass"  # begins the columns of the whole body's centre of mass
FAR = 20.0  # m: no plate or person is farther from the origin of a laboratory
BESIDE = 0.5  # m: a centre of mass farther than that outside the markers is in other units or axes
# ground_force_vx beside ground_torque_x; ground_force_1_vx beside ground_force_1_mx; f1_1 beside p1_1 and m1_1.
OPENSIM_FORCE = re.compile(r"(.*)vx$")
C3D_FORCE = re.compile(r"f(\d+)_1$")
BMCLAB_FORCE = re.compile(r"([LR])GRF_X$")  # beside LCOP_X and LFREEMOMENT_Y, y up


@dataclass(frozen=True, eq=False)
class Storage:
    """An OpenSim storage: columns (T,) by name, in the file's own units."""

    times: Array  # (T,) s
    columns: Mapping[str, Array]  # without the time
    in_degrees: bool | None  # of angles; None: the file does not say
    source: str
    notes: tuple[str, ...] = ()  # where header and table differ

    def __len__(self) -> int:
        return len(self.times)

    def vectors(self, names: tuple[str, str, str]) -> Array:
        """(T, 3) of three columns. ValueError for one that is missing."""
        missing = [name for name in names if name not in self.columns]
        if missing:
            raise ValueError(f"{self.source}: no column {missing[0]!r}; it has {_some(self) or 'none'}")
        return np.stack([self.columns[name] for name in names], axis=1)


def storage(path: str | os.PathLike[str]) -> Storage:
    """The table of a `.mot` or `.sto` file, or of a text whose first line has the columns' names, the time first.

    Fewer or more rows than the header says are a note. ValueError, naming the file and line, for one that is missing,
    no storage, without rows, or with columns or times that cannot be.
    """
    lines = text_file.lines(path)
    end = next((number for number, line in enumerate(lines) if line.strip().lower() == "endheader"), None)
    if end is None and not (lines and lines[0].lower().split()[:1] == ["time"]):
        raise ValueError(f"{path}: expected a storage of OpenSim, whose header ends with 'endheader', got another text")
    header = lines[: end or 0]
    first = 0 if end is None else end + 1
    rows = [(number, line.split()) for number, line in enumerate(lines[first:], first + 1) if line.strip()]
    if not rows:
        raise ValueError(f"{path}: expected a line of column names after the header, the file ends there")
    labels, table = _labels(lines[rows[0][0] - 1], rows), rows[1:]
    twice = _twice(labels)
    if labels[0].lower() != "time" or twice:
        told = f"the column {twice!r} twice" if twice else f"{labels[0]!r} first"
        raise ValueError(f"{path}: line {rows[0][0]}: expected the time first and different names, got {told}")
    numbers = _numbers(str(path), table, len(labels))
    if not len(numbers):
        raise ValueError(f"{path}: expected rows of numbers, got none")
    if not (np.diff(numbers[:, 0]) > 0).all():
        row = int((~(np.diff(numbers[:, 0]) > 0)).argmax()) + 1
        raise ValueError(f"{path}: line {table[row][0]}: expected times that increase, got {numbers[row, 0]:g} s")
    said = _said(header)
    notes = [
        f"its header says {said[name]} {name}, it has {got}"
        for name, got in (("rows", len(table)), ("columns", len(labels)))
        if name in said and said[name] != got
    ]
    degrees = {"yes": True, "no": False}.get(str(said.get("indegrees", "")).lower())
    columns = dict(zip(labels[1:], numbers.T[1:], strict=True))
    return Storage(numbers[:, 0], columns, degrees, str(path), tuple(notes))


def _labels(line: str, rows: list[tuple[int, list[str]]]) -> list[str]:
    """The columns' names, which may have blanks in them where tabs part them."""
    by_tabs = [label.strip() for label in line.strip().split("\t")]
    return by_tabs if len(rows) > 1 and len(by_tabs) == len(rows[1][1]) else rows[0][1]


def _twice(labels: list[str]) -> str | None:
    """The first name that comes again."""
    earlier: set[str] = set()
    for label in labels:
        if label in earlier:
            return label
        earlier.add(label)
    return None


def _numbers(path: str, table: list[tuple[int, list[str]]], width: int) -> Array:
    for number, fields in table:
        if len(fields) != width:
            raise ValueError(
                f"{path}: line {number}: expected {width} columns, got {len(fields)}: is the file complete?"
            )
    places = [f"{path}: line {number}" for number, _ in table]
    return text_file.table([fields for _, fields in table], places).reshape(len(table), width)


def _said(header: list[str]) -> dict[str, int | str]:
    """What the header says of the table: "nRows=29" in OpenSim's own, "datarows 101" in SIMM's."""
    said: dict[str, int | str] = {}
    for line in header:
        key, _, value = line.strip().replace("=", " ", 1).partition(" ")
        key, value = key.lower().removeprefix("n").removeprefix("data"), value.strip()
        if key in ("rows", "columns") and value.isdigit():
            said[key] = int(value)
        elif key == "indegrees":
            said[key] = value
    return said


def has_plates(table: Storage) -> bool:
    """Whether there are ground forces in it."""
    kinds = (OPENSIM_FORCE, C3D_FORCE, BMCLAB_FORCE)
    return any(kind.match(name) for name in table.columns for kind in kinds)


def has_center_of_mass(table: Storage) -> bool:
    """Whether there is a centre of mass of the whole body in it."""
    return f"{COM}_X" in table.columns


def plates(table: Storage, unit: str = "m", up: str = "y") -> ForcePlates:
    """The force plates of a storage, in metres and newtons.

    `unit`: of its points, and its moments are N times that; `up`: which of its axes is up. ValueError, naming the file,
    without plates, for a missing column, and where units or axes cannot be: no plate is tens of metres away, and
    people weigh down.
    """
    if unit not in METRES or up not in UP:
        raise ValueError(f"unit, up: expected one of {', '.join(METRES)} and of x, y, z, got {unit!r} and {up!r}")
    wrenches = [_wrench(table, name) for name in table.columns]
    forces, points, moments = (
        np.stack(part, axis=1) if part else np.empty((len(table), 0, 3))
        for part in ([each[k] for each in wrenches if each is not None] for k in range(3))
    )
    if not forces.shape[1]:
        raise ValueError(f"{table.source}: expected ground forces, such as ground_force_vx, it has {_some(table)}")
    scale = METRES[unit]
    found = ForcePlates(table.times, forces, points * scale, moments * scale, UP[up], table.source)
    _plausible(found, up)
    return found


def _wrench(table: Storage, name: str) -> tuple[Array, Array, Array] | None:
    """Force, point and moment of the plate whose first column this is."""
    adapter, bmclab = C3D_FORCE.match(name), BMCLAB_FORCE.match(name)
    if bmclab:
        f, p = ([f"{bmclab[1]}{kind}_{axis}" for axis in "XYZ"] for kind in ("GRF", "COP"))
        free = table.columns.get(f"{bmclab[1]}FREEMOMENT_Y", np.zeros(len(table)))
        moment = np.stack([0 * free, free, 0 * free], axis=1)
        return table.vectors((f[0], f[1], f[2])), table.vectors((p[0], p[1], p[2])), moment
    if adapter:
        f, p, m = ([f"{letter}{adapter[1]}_{axis}" for axis in (1, 2, 3)] for letter in "fpm")
    else:
        usual = OPENSIM_FORCE.match(name)
        if not usual or f"{usual[1]}px" not in table.columns:
            return None
        begin = usual[1]
        f, p, m = ([f"{begin}{kind}{axis}" for axis in "xyz"] for kind in ("v", "p", "m"))
        if m[0] not in table.columns:
            m = [f"{begin.replace('force', 'torque')}{axis}" for axis in "xyz"]
    nothing = np.zeros((len(table), 3))
    moment = table.vectors((m[0], m[1], m[2])) if m[0] in table.columns else nothing
    return table.vectors((f[0], f[1], f[2])), table.vectors((p[0], p[1], p[2])), moment


def _plausible(found: ForcePlates, up: str) -> None:
    with np.errstate(invalid="ignore"):
        heavy = np.linalg.norm(found.forces, axis=-1) > 10 * LOADED
    if not heavy.any():
        return
    away = float(np.nanmedian(np.abs(found.points[heavy]).max(axis=-1)))
    if away > FAR:
        raise ValueError(
            f"{found.source}: looks like millimetres: centres of pressure {away:.4g} from the origin, expected metres, "
            f"up to {FAR:g}; say unit='mm' if so"
        )
    push = np.median(found.forces[heavy], axis=0)
    axis = "xyz"[int(np.abs(push).argmax())]
    if axis != up:
        raise ValueError(
            f"{found.source}: looks like {axis} up: loaded plates push along {axis} ({push[0]:.0f}, {push[1]:.0f}, "
            f"{push[2]:.0f} N), expected along {up}; say up={axis!r} if so"
        )


def center_of_mass(table: Storage) -> Array:
    """The whole body's centre of mass (T, 3) m, y up. ValueError, naming the file, if missing or in other units."""
    points = table.vectors((f"{COM}_X", f"{COM}_Y", f"{COM}_Z"))
    away = float(np.median(np.abs(points).max(axis=1)))
    if away > FAR:
        raise ValueError(
            f"{table.source}: looks like millimetres: a centre of mass {away:.4g} from the origin, in metres"
        )
    return points


def open(path: str | os.PathLike[str], split: str | None = None) -> DataSet:
    """The recordings of a `.trc` file, or of all those in a folder, a sequence each. There are no splits.

    Raises ValueError naming the file for what is missing, damaged, or in units or axes that cannot be.
    """
    if split is not None:
        raise ValueError(f"split: recordings have none, got {split!r}")
    files = sequences.recordings(path, ".trc")
    tracks = [trc.read(file) for file in files]
    markers = list(dict.fromkeys(name for found in tracks for name in found.names))
    parts = [
        _frames(file.stem, found, markers, *beside)
        for file, found, beside in zip(files, tracks, _beside(files), strict=True)
    ]
    return demanded(Path(path), Joined(sequences.measured_alike(parts)))


def _frames(name: str, tracks: Tracks, markers: list[str], forces: Path | None, com: Path | None) -> Frames:
    joints = np.full((len(tracks), len(markers), 3), np.nan)
    seen = np.where(tracks.confidence[..., None] > 0, tracks.points, np.nan)
    joints[:, [markers.index(marker) for marker in tracks.names]] = seen
    demand(tracks.source, size_of_body("joints", joints))
    at = None if forces is None else plates(storage(forces)).at(tracks.times)
    lasted = float(tracks.times[-1] - tracks.times[0])  # the times of single samples are often rounded to milliseconds
    return Frames(
        names=sequences.numbered(name, len(tracks)),
        sequences=np.full(len(tracks), name),
        ground=Ground.y_up(),
        frame_rate=round((len(tracks) - 1) / lasted, 2) if lasted > 0 else None,
        joints=joints,
        joint_names=tuple(markers),
        center_of_mass=None if com is None else _com_at(storage(com), tracks),
        center_of_pressure=None if at is None else at.center(),
        forces=None if at is None else at.forces,
    )


def _com_at(table: Storage, tracks: Tracks) -> Array:
    """(T, 3) m at the markers' times; NaN outside the storage's. ValueError if it is nowhere near the markers."""
    points = center_of_mass(table)
    found = between(table.times, points, tracks.times)
    seen = tracks.confidence.any(axis=1)
    shown = tracks.confidence[seen][..., None] > 0
    low = np.where(shown, tracks.points[seen], np.inf).min(axis=1)
    high = np.where(shown, tracks.points[seen], -np.inf).max(axis=1)
    away = np.linalg.norm(np.maximum(0, np.maximum(low - found[seen], found[seen] - high)), axis=1)
    if np.isfinite(away).any() and np.nanmedian(away) > BESIDE:
        raise ValueError(
            f"{table.source}: the centre of mass is {np.nanmedian(away):.2f} m outside the markers of {tracks.source}; "
            "expected it among them: are both in metres, y up, and of one recording?"
        )
    return found


def check(path: str | os.PathLike[str]) -> list[Finding]:
    """Which recordings there are, what belongs to each, and whether units and axes can be right."""
    try:
        files = sequences.recordings(path, ".trc")
    except ValueError as error:
        return [Finding("missing", str(error), "expected a .trc file or a folder of them")]
    found = [Finding("ok", f"{len(files)} .trc {'file' if len(files) == 1 else 'files'}")]
    try:
        beside = _beside(files)
    except ValueError as error:
        return [*found, Finding("wrong", str(error))]
    for file, (forces, com) in zip(files, beside, strict=True):
        for what, other, ending in (("forces", forces, "_grf.mot"), ("centre of mass", com, "_com.sto")):
            if other is None:
                found.append(Finding("missing", f"{file.name}: no {what}", f"expected such as {file.stem}{ending}"))
            else:
                found.append(Finding("ok", f"{file.name}: {what} in {other.name}"))
        try:
            tracks = trc.read(file)
            found += standing(file.name, tracks.points, tracks.confidence > 0, "y")
            found += sequences.told(file.name, _frames(file.stem, tracks, list(tracks.names), forces, com))
        except ValueError as error:
            found.append(Finding("wrong", str(error)))
    return found


def _beside(files: list[Path]) -> list[tuple[Path | None, Path | None]]:
    """Forces and centre of mass of each recording."""
    found: dict[Path, list[Path | None]] = {file: [None, None] for file in files}
    for folder in dict.fromkeys(file.parent for file in files):
        here = [file for file in files if file.parent == folder]
        others = [other for other in sorted(folder.iterdir()) if other.suffix.lower() in (".mot", ".sto")]
        for place, has in enumerate((has_plates, has_center_of_mass)):  # forces first: they tell whose the rest are
            for other in others:
                owner = _owner(other, here, [file for file in here if found[file][0] is not None])
                if owner is None or not has(storage(other)):
                    continue
                if found[owner][place] is not None:
                    raise ValueError(f"{other}: expected one of its kind for {owner.name}, got another beside it")
                found[owner][place] = other
    return [(pair[0], pair[1]) for pair in found.values()]


def _owner(other: Path, files: list[Path], with_forces: list[Path]) -> Path | None:
    """The recording with the longest name that the other file's has in it; else the only one with forces, if any."""
    named = [file for file in files if file.stem.lower() in other.stem.lower()]
    if named:
        return max(named, key=lambda file: len(file.stem))
    return with_forces[0] if len(with_forces) == 1 else None


def _some(table: Storage) -> str:
    names = list(table.columns)
    return ", ".join(names[:8]) + (", …" if len(names) > 8 else "")
