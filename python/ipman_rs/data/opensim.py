"""OpenSim's recordings: markers in `.trc`, force plates and centres of mass in `.mot` and `.sto`.

Expected: a `.trc` file, or a folder of them, and in the same folder or one of its own storages of the same name:
`walk.trc`, `walk_grf.mot` (ground forces), `walk_com.sto` (BodyKinematics' positions: center_of_mass_X, Y, Z); so also
`markers_walk.trc` and `grf_walk.mot`, `MarkerData/walk.trc` and `ID/walk_grf.mot`, `walk/markers.trc` and
`walk/grf.mot`, or the only two of a folder. An ExternalLoads file (.xml) that names the forces says in which columns
they are. Forces that point down are those on the plates, and are turned. OpenSim's world is
y up, right-handed, in metres; the floor is y = 0. A `.trc` says its unit; a storage does not, and its forces and points
must be N and m (`plates` takes other units). Frames have the markers' rate (often 60 or 100 Hz; force plates have
their own, and are read at the markers' times). No cameras. Such files come with OpenSim's models, SimTK projects,
OpenCap and AddBiomechanics.
"""

from __future__ import annotations

import os
import re
from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ipman_rs.ground import Ground

from . import external_loads, pairing, sequences, trc
from .c3d_plates import LOADED
from .check import Finding, first_names, raise_if_wrong, require_plausible, size_of_body
from .external_loads import ExternalLoads, Load
from .force_plates import UP, ForcePlates, check_longest_axis, drop_unreadable_plates, interpolate
from .frames import DataSet, Frames
from .joined import Joined
from .opensim_storage import Storage as Storage
from .opensim_storage import storage as storage
from .tracks import METRES, Tracks

NAME = "opensim"

Array = NDArray[np.float64]

COM = "center_of_mass"  # begins the columns of the whole body's centre of mass
FAR = 20.0  # m: no plate or person is farther from the origin of a laboratory
CENTIMETRES = 500  # a centre of mass no farther from the origin is so many centimetres, for it is a metre high
LONGER = 100  # times as long as the markers, without as many more samples: forces whose times are in another unit
BESIDE = 0.5  # m: a centre of mass farther than that outside the markers is in other units or axes
# ground_force_vx beside ground_torque_x; ground_force_1_vx beside ground_force_1_mx; f1_1 beside p1_1 and m1_1.
OPENSIM_FORCE = re.compile(r"(.*)vx$")
C3D_FORCE = re.compile(r"f(\d+)_1$")
BMCLAB_FORCE = re.compile(r"([LR])GRF_X$")  # beside LCOP_X and LFREEMOMENT_Y, y up


def has_plates(table: Storage) -> bool:
    """Whether there are ground forces in it."""
    kinds = (OPENSIM_FORCE, C3D_FORCE, BMCLAB_FORCE)
    return any(kind.match(name) for name in table.columns for kind in kinds)


def has_center_of_mass(table: Storage) -> bool:
    """Whether there is a centre of mass of the whole body in it, not its velocity or acceleration."""
    return f"{COM}_X" in table.columns and derivative(Path(table.source)) is None


def derivative(path: Path) -> str | None:
    """ "velocities" or "accelerations", of which BodyKinematics writes a file each with the columns of the positions;
    None for positions. The first line says it, or else the name."""
    try:
        with path.open(encoding="utf-8", errors="replace") as lines:
            title = lines.readline().strip().lower()
    except OSError:
        title = ""
    if title.startswith("position"):
        return None
    words = re.split(r"[^a-z]+", path.stem.lower())
    for word, what in (("velocit", "velocities"), ("accelerat", "accelerations")):
        if title.startswith(word) or any(part == word[:3] or part.startswith(word) for part in words):
            return what
    return None


def kind(table: Storage) -> str | None:
    """ "forces", "com", or None for a storage of something else."""
    return "forces" if has_plates(table) else "com" if has_center_of_mass(table) else None


def plates(table: Storage, unit: str = "m", up: str = "y", loads: ExternalLoads | None = None) -> ForcePlates:
    """The force plates of a storage, in metres and newtons.

    `unit`: of its points, and its moments are N times that; `up`: which of its axes is up; `loads`: in which columns
    the forces are, where an ExternalLoads file says so. Forces on the plates are turned into those on the body.
    ValueError, naming the file, without plates, for a missing column, and where units or axes cannot be: no plate is
    tens of metres away, and people weigh down.
    """
    if unit not in METRES or up not in UP:
        raise ValueError(f"unit, up: expected one of {', '.join(METRES)} and of x, y, z, got {unit!r} and {up!r}")
    wrenches = (
        [_external_force(table, load, loads.source) for load in loads.loads]
        if loads is not None and loads.loads
        else [measured for name in table.columns if (measured := _wrench(table, name)) is not None]
    )
    if not wrenches:
        has = first_names([*table.columns])
        raise ValueError(f"{table.source}: expected ground forces, such as ground_force_vx, it has {has}")
    forces, points, moments = (np.stack(part, axis=1) for part in zip(*wrenches, strict=True))
    scale = METRES[unit]
    forces, points, moments = (  # beside NaN, infinity: a centre of pressure without a load
        np.where(np.isfinite(part), part, np.nan) for part in (forces, points * scale, moments * scale)
    )
    measured = ForcePlates(table.times, forces, points, moments, UP[up], table.source, notes=table.notes)
    _check_plates(measured, up)
    if loads is not None and (unnamed := _unnamed(table, measured)):
        note = f"forces that {loads.source} does not name are left out: {', '.join(unnamed)}"
        measured = replace(measured, notes=(*measured.notes, note))
    return drop_unreadable_plates(reverse_forces_on_plates(measured))


def _unnamed(table: Storage, plates: ForcePlates) -> list[str]:
    """The first columns of plates that carry a load and are not among those found."""
    known = [plates.forces[:, plate] for plate in range(plates.forces.shape[1])]
    names = []
    for name in table.columns:
        wrench = _wrench(table, name)
        loaded = wrench is not None and np.nanmax(np.abs(wrench[0]), initial=0.0) > LOADED
        if wrench is not None and loaded and not any(np.array_equal(wrench[0], one, equal_nan=True) for one in known):
            names.append(name)
    return names


def reverse_forces_on_plates(plates: ForcePlates) -> ForcePlates:
    """With forces that act on the body, also of plates of which the file has the opposite: nobody pulls at a plate."""
    with np.errstate(invalid="ignore"):
        loads = np.nansum(np.where(np.abs(plates.loads) > LOADED, plates.loads, 0.0), axis=0)
    if (loads >= 0).all():
        return plates
    sign = np.where(loads < 0, -1.0, 1.0)[:, None]
    which = "" if (loads < 0).all() else f" of plate {', '.join(str(plate + 1) for plate in np.flatnonzero(loads < 0))}"
    note = f"the forces{which} point down, as those on the plates do; they were turned round"
    return replace(plates, forces=sign * plates.forces, moments=sign * plates.moments, notes=(*plates.notes, note))


def check_loads(plates: ForcePlates, times: Array) -> list[Finding]:
    """Findings if the plates are of no use for a recording with these times (T,) s: no overlap in time, or no load."""
    begin, end = float(plates.times[0]), float(plates.times[-1])
    first, last = float(times[0]), float(times[-1])
    spans = f"forces t {begin:.2f} to {end:.2f} s, markers t {first:.2f} to {last:.2f} s"
    if end < first or begin > last:
        return [Finding("wrong", f"times do not overlap: {spans}", "are both of one recording, with one clock?")]
    if end - begin > LONGER * (last - first) and len(plates) < LONGER * len(times):
        return [Finding("wrong", f"times look like milliseconds: {spans}", "expected seconds")]
    during = (plates.times >= first) & (plates.times <= last)
    loads = plates.loads[during]
    most = float(np.nanmax(loads)) if np.isfinite(loads).any() else 0.0
    if not most > LOADED:
        what = f"no frame has a loaded plate: the largest load is {most:.0f} N, expected over {LOADED:.0f} N ({spans})"
        return [Finding("wrong", what, "are these the recording's forces, in newtons?")]
    return []


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


def _external_force(table: Storage, load: Load, source: str) -> tuple[Array, Array, Array]:
    """Force, point and moment of an ExternalForce, whose columns begin with its identifiers."""
    force, point = (_vector_columns(table, name) for name in (load.force, load.point))
    if force is None or point is None:
        missing = load.force if force is None else load.point
        has = f"{table.source} has {first_names([*table.columns])}"
        raise ValueError(f"{source}: expected three columns that begin with {missing!r}; {has}")
    torque = _vector_columns(table, load.torque) if load.torque else None
    return force, point, np.zeros_like(force) if torque is None else torque


def _vector_columns(table: Storage, begin: str) -> Array | None:
    """The columns (T, 3) whose names begin so: with x, y, z behind it, or the only three."""
    for ends in ("xyz", "XYZ", "123"):
        if all(f"{begin}{end}" in table.columns for end in ends):
            return table.vectors((f"{begin}{ends[0]}", f"{begin}{ends[1]}", f"{begin}{ends[2]}"))
    names = [name for name in table.columns if name.startswith(begin)]
    return table.vectors((names[0], names[1], names[2])) if len(names) == 3 else None


def _check_plates(plates: ForcePlates, up: str) -> None:
    with np.errstate(invalid="ignore"):
        heavy = np.linalg.norm(plates.forces, axis=-1) > 10 * LOADED
    if not heavy.any():
        return
    away = float(np.nanmedian(np.abs(plates.points[heavy]).max(axis=-1)))
    if away > FAR:
        other = "" if away > 100 * FAR else ", or unit='cm' for centimetres (`force_unit='cm'`)"
        raise ValueError(
            f"{plates.source}: looks like millimetres: centres of pressure {away:.4g} from the origin, expected "
            f"metres, up to {FAR:g}; say unit='mm' if so (`force_unit='mm'`){other}"
        )
    push = np.median(np.abs(plates.forces[heavy]), axis=0)  # of either sign: see `reverse_forces_on_plates`
    axis = "xyz"[int(push.argmax())]
    if axis != up:
        raise ValueError(
            f"{plates.source}: looks like {axis} up: loaded plates push along {axis} ({push[0]:.0f}, {push[1]:.0f}, "
            f"{push[2]:.0f} N), expected along {up}; `force_up={axis!r}` if so"
        )


def center_of_mass(table: Storage) -> Array:
    """The whole body's centre of mass (T, 3) m, y up. ValueError, naming the file, if missing or in other units."""
    points = table.vectors((f"{COM}_X", f"{COM}_Y", f"{COM}_Z"))
    away = float(np.median(np.abs(points).max(axis=1)))
    if away > FAR:
        word = "millimetres" if away > CENTIMETRES else "centimetres"
        raise ValueError(f"{table.source}: looks like {word}: a centre of mass {away:.4g} from the origin, in metres")
    return points


def open(path: str | os.PathLike[str], split: str | None = None) -> DataSet:
    """The recordings of a `.trc` file, or of all those in a folder, a sequence each. There are no splits.

    Raises ValueError naming the file for what is missing, damaged, or in units or axes that cannot be.
    """
    if split is not None:
        raise ValueError(f"split: recordings have none, got {split!r}")
    files = sequences.recordings(path, ".trc")
    tracks = [trc.read(file) for file in files]
    markers = list(dict.fromkeys(name for recording in tracks for name in recording.names))
    beside = _companion_files(Path(path), files)
    for other, file in beside.pairs.rivals.items():
        raise ValueError(f"{other}: expected one of its kind for {file.name}, got another beside it; take one away")
    parts = [
        _frames(name, recording, markers, *beside.of(file))
        for name, file, recording in zip(beside.names, files, tracks, strict=True)
    ]
    return require_plausible(Path(path), Joined(sequences.fill_missing(parts)))


def _frames(
    name: str, tracks: Tracks, markers: list[str], forces: Path | None, loads: ExternalLoads | None, com: Path | None
) -> Frames:
    joints = np.full((len(tracks), len(markers), 3), np.nan)
    points = np.where(tracks.confidence[..., None] > 0, tracks.points, np.nan)
    column = {marker: index for index, marker in enumerate(markers)}
    joints[:, [column[marker] for marker in tracks.names]] = points
    raise_if_wrong(tracks.source, size_of_body("joints", joints))
    at = None if forces is None else plates(storage(forces), loads=loads).at(tracks.times)
    lasted = float(tracks.times[-1] - tracks.times[0])  # the times of single samples are often rounded to milliseconds
    return Frames(
        names=sequences.frame_names(name, len(tracks)),
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
    centers = interpolate(table.times, center_of_mass(table), tracks.times)
    for each in check_near_markers(centers, tracks, "centre of mass"):
        raise ValueError(f"{table.source}: {each.what}; {each.advice}")
    return centers


def check_near_markers(points: Array, tracks: Tracks, what: str) -> list[Finding]:
    """Whether a centre of mass or of pressure (T, 3) m, NaN where there is none, is where the markers are."""
    recorded = tracks.confidence.any(axis=1)
    shown = tracks.confidence[recorded][..., None] > 0
    low = np.where(shown, tracks.points[recorded], np.inf).min(axis=1)
    high = np.where(shown, tracks.points[recorded], -np.inf).max(axis=1)
    away = np.linalg.norm(np.maximum(0, np.maximum(low - points[recorded], points[recorded] - high)), axis=1)
    away = away[np.isfinite(away)]
    if not len(away) or np.median(away) <= BESIDE:
        return []
    message = f"the {what} is {np.median(away):.2f} m outside the markers of {tracks.source}"
    return [Finding("wrong", message, "expected it among them: are both in metres, y up, and of one recording?")]


def check(path: str | os.PathLike[str]) -> list[Finding]:
    """Which recordings there are, what belongs to each, and whether units, axes and times can be right."""
    try:
        files = sequences.recordings(path, ".trc")
    except ValueError as error:
        return [Finding("missing", str(error), "expected a .trc file or a folder of them")]
    findings = [Finding("ok", f"{len(files)} .trc {'file' if len(files) == 1 else 'files'}")]
    beside = _companion_files(Path(path), files)
    findings += [Finding("wrong", what) for what in beside.unreadable]
    findings += [Finding("odd", note) for note in beside.pairs.notes]
    for other, why in beside.pairs.left.items():
        level = "wrong" if other in beside.pairs.rivals else "odd"
        findings.append(Finding(level, f"{other.name}: not used, for {why}"))
    for name, file in zip(beside.names, files, strict=True):
        forces, loads, com = beside.of(file)
        for what, other, ending in (("forces", forces, "_grf.mot"), ("centre of mass", com, "_com.sto")):
            if other is None:
                findings.append(Finding("missing", f"{file.name}: no {what}", f"expected such as {file.stem}{ending}"))
            else:
                findings.append(Finding("ok", f"{file.name}: {what} in {other.name}"))
        try:
            tracks = trc.read(file)
            of_markers = _check_markers(tracks, file.name)
            findings += of_markers
            if any(each.level == "wrong" for each in of_markers):
                continue  # what else can be told of them only repeats it
            findings += sequences.check_recording(
                file.name, _frames(name, tracks, list(tracks.names), forces, loads, com)
            )
            if forces is not None:
                findings += _check_forces(plates(storage(forces), loads=loads), tracks, forces.name)
        except ValueError as error:
            findings.append(Finding("wrong", str(error)))
    return findings


def _check_markers(tracks: Tracks, name: str) -> list[Finding]:
    """What `ipman fit` says of them, and how they stand where nobody knows the places of their names."""
    from ipman_rs.data.markers import plausibility

    findings = [Finding("odd", note) for note in tracks.notes] + plausibility.check_tracks(tracks)
    findings = [replace(each, what=f"{name}: {each.what}") for each in findings if each.level != "ok"]
    if any(each.level == "wrong" for each in findings):
        return findings
    return findings + check_longest_axis(name, tracks.points, tracks.confidence > 0, "y")


def _check_forces(plates: ForcePlates, tracks: Tracks, name: str) -> list[Finding]:
    findings = check_loads(plates, tracks.times) or check_near_markers(
        plates.at(tracks.times).center(), tracks, "centre of pressure"
    )
    notes = [Finding("odd", f"{name}: {note}") for note in plates.notes]
    return notes + [Finding(each.level, f"{name}: {each.what}", each.advice) for each in findings]


@dataclass(frozen=True)
class CompanionFiles:
    """The files that belong to marker files: `pairs`, the columns of forces (`loads`) by file, the recordings' `names`,
    and what is wrong with `unreadable` files."""

    pairs: pairing.Pairs
    loads: Mapping[Path, ExternalLoads]
    names: list[str]
    unreadable: list[str]

    def of(self, file: Path) -> tuple[Path | None, ExternalLoads | None, Path | None]:
        """Forces, their columns, and centre of mass of a recording."""
        forces = self.pairs.forces.get(file)
        return forces, None if forces is None else self.loads.get(forces), self.pairs.com.get(file)


def _companion_files(path: Path, files: list[Path]) -> CompanionFiles:
    """Forces and centre of mass of each recording, anywhere below a folder or in the folder of the only file."""
    root = path if path.is_dir() else path.parent
    below = sorted(each for each in (root.rglob("*") if path.is_dir() else root.iterdir()) if each.is_file())
    kinds: dict[Path, str] = {}
    unreadable: dict[Path, str] = {}
    for other in below:
        if other.suffix.lower() not in (".mot", ".sto"):
            continue
        try:
            what = kind(storage(other))
        except ValueError as error:
            what, unreadable[other] = "forces", str(error)  # it is told again, where it belongs to a recording
        if what is not None:
            kinds[other] = what
    loads, aliases, wrong = external_loads.find(below)
    kinds |= dict.fromkeys(loads, "forces")
    pairs = pairing.pair(files, kinds, root, aliases=aliases)
    used = {*pairs.forces.values(), *pairs.com.values()}
    damaged = [what for other, what in unreadable.items() if other not in used]
    pairs.notes += wrong
    return CompanionFiles(pairs, loads, pairing.names(files, root), damaged)
