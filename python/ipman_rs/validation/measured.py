"""Forces and centres of mass from their files, in the axes of the markers: metres, y up."""

from __future__ import annotations

import csv
from dataclasses import replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ..data import c3d, force_plates, opensim
from ..data.external_loads import ExternalLoads
from ..data.force_plates import ForcePlates, interpolate
from ..data.tracks import TO_Y_UP
from ..files import regular_file

Array = NDArray[np.float64]
Up = tuple[float, float, float] | None  # a direction in a file's own axes; None: as it says

NEITHER = "it has neither forces (ground_force_vx beside ground_force_px) nor a centre of mass (center_of_mass_X)"
CSV_COLUMNS = ("time_s", "com_x_m", "com_y_m", "com_z_m")


def kind_of(path: Path) -> tuple[str | None, str]:
    """What a table holds: "forces", "com", or None, and then why it is of no use. ValueError, naming the file, if it
    cannot be read."""
    if path.suffix.lower() == ".csv":
        if not set(CSV_COLUMNS) <= set(_column_names(path)):
            return None, NEITHER
        _csv(path)
        return "com", ""
    table = opensim.storage(path)
    moves = opensim.derivative(path)
    if moves is not None and f"{opensim.COM}_X" in table.columns:
        return None, f"it has {moves}; the positions are compared"
    return opensim.kind(table), NEITHER


def has_plates(path: Path) -> bool:
    """Whether a `.c3d` file has force plates; what else is wrong with it comes up when it is read."""
    try:
        return c3d.read(path).has_plates
    except ValueError:
        return False


def has_center_of_mass(path: Path) -> bool:
    """Whether a `.c3d` file has a centre of mass that a model such as Plug-in Gait computed."""
    try:
        return c3d.read(path).center_of_mass() is not None
    except ValueError:
        return False


def plates(
    path: Path, up: Up = None, unit: str = "m", loads: ExternalLoads | None = None, length: float | None = None
) -> ForcePlates:
    """The force plates of a `.c3d`, `.mot` or `.sto` file, y up. ValueError, naming the file, for what is not right.

    `up`: what points up in the file, if that is not what it says, or y; `unit`: of the points of a `.mot` or `.sto`;
    `loads`: in which of its columns the forces are; `length`: metres in one of a `.c3d`'s, if it says that wrongly.
    """
    if path.suffix.lower() == ".c3d":
        recording = _recording(path, length)
        axis = _axis(up, recording.up, path)
        return force_plates.from_c3d(recording, axis).turned(TO_Y_UP[axis])
    axis = _axis(up, "y", path)
    return opensim.plates(opensim.storage(path), unit, axis, loads).turned(TO_Y_UP[axis])


def center_of_mass(
    path: Path, times: Array, up: Up = None, subject: str | None = None, length: float | None = None
) -> Array:
    """A measured centre of mass (n, 3) m at these times, y up, NaN outside the file's. ValueError, naming the file.

    `up` and `length` as in `plates`; `subject`: whose, where a `.c3d` has several people.
    """
    if path.suffix.lower() == ".c3d":
        recording = _recording(path, length)
        points = recording.center_of_mass(subject)
        if points is None:
            raise ValueError(f"{path}: expected a centre of mass by a model such as Plug-in Gait, it has none")
        return interpolate(recording.times, points @ TO_Y_UP[_axis(up, recording.up, path)].T, times)
    if path.suffix.lower() == ".csv":
        own, points = _csv(path)
    else:
        table = opensim.storage(path)
        own, points = table.times, opensim.center_of_mass(table)
    return interpolate(own, points @ TO_Y_UP[_axis(up, "y", path)].T, times)


def _recording(path: Path, length: float | None) -> c3d.C3DFile:
    recording = c3d.read(path)
    return recording if length is None else replace(recording, unit=length)


def _axis(up: Up, usual: str, path: Path) -> str:
    """The axis that points up, of which `turned` knows the way to y. ValueError for another direction."""
    if up is None:
        return usual
    named = [axis for axis, one in zip("xyz", np.eye(3), strict=True) if np.array_equal(up, one)]
    if not named:
        raise ValueError(f"{path}: up: expected x, y or z for forces and centres of mass, got {tuple(up)}")
    return named[0]


def reference_name(path: Path) -> str:
    """Whose a centre of mass is."""
    if path.suffix.lower() == ".c3d":
        return "Plug-in Gait"
    return path.stem if path.suffix.lower() == ".csv" and "opensim" not in path.stem.lower() else "OpenSim"


def _column_names(path: Path) -> list[str]:
    """The names of the columns, which may stand in a comment and have a remark behind them."""
    with path.open(encoding="utf-8", errors="replace", newline="") as stream:
        first = next(csv.reader(stream), [])
    return [name.strip().lstrip("#").split("(")[0].strip() for name in first]


def _csv(path: Path) -> tuple[Array, Array]:
    """Times (T,) s and centres of mass (T, 3) m."""
    heads = _column_names(regular_file(path))
    with path.open(encoding="utf-8", errors="replace", newline="") as stream:
        rows = [(number, row) for number, row in enumerate(csv.reader(stream), 1) if number > 1 and row]
    if not rows:
        raise ValueError(f"{path}: expected rows of numbers, got none")
    for number, row in rows:
        if len(row) != len(heads):
            raise ValueError(
                f"{path}: line {number}: expected {len(heads)} columns, got {len(row)}: is the file complete?"
            )
    try:
        numbers = np.array([[row[heads.index(name)] for name in CSV_COLUMNS] for _, row in rows], float)
    except ValueError as error:
        raise ValueError(f"{path}: expected numbers: {error}") from None
    if not (np.diff(numbers[:, 0]) > 0).all():
        raise ValueError(f"{path}: expected times that increase")
    return numbers[:, 0], numbers[:, 1:]
