"""Forces and centres of mass from their files, in the axes of the markers: metres, y up."""

from __future__ import annotations

import csv
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ..data import c3d, force_plates, opensim
from ..data.force_plates import ForcePlates, between
from ..data.tracks import TO_Y_UP
from ..files import regular

Array = NDArray[np.float64]

CSV_COLUMNS = ("time_s", "com_x_m", "com_y_m", "com_z_m")


def kind_of(path: Path) -> str | None:
    """What a table holds: "forces", "com", or nothing of use. ValueError, naming the file, if it cannot be read."""
    if path.suffix.lower() == ".csv":
        if not set(CSV_COLUMNS) <= set(_heads(path)):
            return None
        _csv(path)
        return "com"
    table = opensim.storage(path)
    return "forces" if opensim.has_plates(table) else "com" if opensim.has_center_of_mass(table) else None


def has_plates(path: Path) -> bool:
    """Whether a `.c3d` file has force plates; what else is wrong with it comes up when it is read."""
    try:
        return any(c3d.read(path).values("FORCE_PLATFORM", "USED")[:1])
    except (ValueError, ImportError):
        return False


def plates(path: Path) -> ForcePlates:
    """The force plates of a `.c3d`, `.mot` or `.sto` file. ValueError, naming the file, for what is not right in it."""
    if path.suffix.lower() == ".c3d":
        found = c3d.read(path)
        return force_plates.of_recording(found).turned(TO_Y_UP[found.up])
    return opensim.plates(opensim.storage(path))


def center_of_mass(path: Path, times: Array) -> Array:
    """A measured centre of mass (n, 3) m at these times, NaN outside the file's. ValueError, naming the file."""
    if path.suffix.lower() == ".csv":
        own, points = _csv(path)
    else:
        table = opensim.storage(path)
        own, points = table.times, opensim.center_of_mass(table)
    return between(own, points, times)


def _heads(path: Path) -> list[str]:
    """The names of the columns, which may stand in a comment and have a remark behind them."""
    with path.open(encoding="utf-8", errors="replace", newline="") as stream:
        first = next(csv.reader(stream), [])
    return [name.strip().lstrip("#").split("(")[0].strip() for name in first]


def _csv(path: Path) -> tuple[Array, Array]:
    """Times (T,) s and centres of mass (T, 3) m."""
    heads = _heads(regular(path))
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
