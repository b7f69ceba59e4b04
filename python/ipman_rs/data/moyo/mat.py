"""MoYo's pressure mat: its maps, their centres of pressure, and where it lies."""

from __future__ import annotations

import csv
import os
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from xml.etree.ElementTree import Element

import numpy as np
from numpy.typing import NDArray

from ipman_rs.files import regular_file, safe_pickle

from ...files import safe_xml
from .. import c3d
from ..check import Finding
from ..frames import PressureMaps
from .files import SequenceFiles

Array = NDArray[np.float64]

RATE = 60.0  # Hz
UNIT = "N/cm2"  # of the maps
CORNERS = tuple(f"SensorMat:M_{number}" for number in (1, 2, 3, 4))
FORCE = "Force (N)"
COP = tuple(f"Pressure, Raw Pressure-distribution-Pressure center-{axis} (mm)" for axis in "xy")


@dataclass(frozen=True, eq=False)
class Mat:
    """What the mat recorded: all maps, and the centres of pressure of some of them. Rows run along +y of the mat."""

    maps: NDArray[np.float32]  # (N, H, W) N/cm²
    cell: float  # m
    rate: float  # Hz


def read_maps(path: str | os.PathLike[str]) -> Mat:
    """The maps of an XML file of the mat; each is stored as a crop, upside down.

    ValueError, naming the file, for a document type, and for what is damaged, missing, or in other units than N/cm² and
    millimetres.
    """
    clip = _anywhere(safe_xml.read(path), "clip", path)
    width, height = _pair(clip, ".//cell_count", path)  # the first is the mat's
    size = [safe_xml.number(clip, f".//cell_size/{axis}", path) for axis in "xy"]
    if abs(size[0] - size[1]) > 1e-6 or not 1 < size[0] < 100:
        hint = "; looks like metres" if 0 < size[0] < 0.1 else ""
        raise ValueError(f"{path}: cell_size: expected square cells, in millimetres, got {size[0]} × {size[1]}{hint}")
    unit = clip.find(".//units")
    if unit is not None and (unit.text or "").strip() != UNIT:
        raise ValueError(f"{path}: units: expected {UNIT}, got {unit.text!r}")
    if not (0 < width <= 4096 and 0 < height <= 4096):
        raise ValueError(f"{path}: cell_count: expected a mat of some thousand cells, got {width} × {height}")
    data = _anywhere(clip, "data", path)
    crops = [element for element in data.iter() if element.find("cells") is not None]
    count = safe_xml.number(clip, ".//count", path)
    if count != len(crops):
        raise ValueError(f"{path}: expected {count:g} maps by its count, got {len(crops)}: is the file complete?")
    if len(crops) * width * height * 4 > safe_pickle.MAX_BYTES:
        raise ValueError(f"{path}: {len(crops)} maps of {width} × {height} cells are more than any recording has")
    maps = np.zeros((len(crops), height, width), np.float32)
    for number, (crop, whole) in enumerate(zip(crops, maps, strict=True)):
        _uncrop(crop, whole, f"{path}: map {number}")
    return Mat(maps, size[0] / 1000, safe_xml.number(clip, ".//frequency", path))


def _anywhere(element: Element, tag: str, path: str | os.PathLike[str]) -> Element:
    match = element if element.tag == tag else element.find(f".//{tag}")
    if match is None:
        raise ValueError(f"{path}: expected a recording of the pressure mat, with <{tag}>, got <{element.tag}>")
    return match


def _pair(element: Element, tag: str, path: str | os.PathLike[str]) -> tuple[int, int]:
    x, y = (safe_xml.number(element, f"{tag}/{axis}", path) for axis in "xy")
    if not (x.is_integer() and y.is_integer()):
        raise ValueError(f"{path}: {tag.removeprefix('.//')}: expected whole numbers, got {x} and {y}")
    return int(x), int(y)


def _uncrop(crop: Element, whole: NDArray[np.float32], place: str) -> None:
    """The cells of a map, put where they are on the mat."""
    (column, row), (width, height) = _pair(crop, "cell_begin", place), _pair(crop, "cell_count", place)
    if min(column, row, width, height) < 0 or row + height > whole.shape[0] or column + width > whole.shape[1]:
        raise ValueError(
            f"{place}: expected cells of a mat of {whole.shape[1]} × {whole.shape[0]}, got {width} × {height} from "
            f"({column}, {row})"
        )
    try:
        with np.errstate(over="ignore"):  # what is too large is refused as infinite
            values = np.array((crop.findtext("cells") or "").split(), np.float32)
    except ValueError as error:
        raise ValueError(f"{place}: expected numbers: {error}") from None
    if values.size != width * height:
        raise ValueError(f"{place}: expected {width * height} cells, got {values.size}: is the file complete?")
    if not np.isfinite(values).all() or (values < 0).any():
        raise ValueError(f"{place}: expected pressures of 0 or more, got {values.min()} to {values.max()}")
    whole[row : row + height, column : column + width] = values.reshape(height, width)[::-1]


@dataclass(frozen=True, eq=False)
class Trace:
    """Force and centre of pressure over the frames of a sequence, and the numbers of their maps."""

    maps: NDArray[np.int64]  # (F,)
    force: Array  # (F,) N
    center: Array  # (F, 2) m, along the mat's columns and rows; NaN without a load
    rate: float


def read_trace(path: str | os.PathLike[str]) -> Trace:
    """A CSV file of the mat: two lines about the recording, then a table.

    ValueError, naming the file, for what is missing, damaged, with gaps, or at another rate than 60 Hz.
    """
    regular_file(path)
    try:
        with Path(path).open(encoding="utf-8-sig", errors="replace", newline="") as stream:
            lines = [row for row in csv.reader(stream) if any(field.strip() for field in row)]
    except OSError as error:
        raise ValueError(f"{path}: {error.strerror}") from None
    except csv.Error as error:
        raise ValueError(f"{path}: expected comma-separated values: {error}") from None
    if len(lines) < 4:
        raise ValueError(
            f"{path}: expected a line of names and of values, and a table with its names, got {len(lines)} lines"
        )
    about = dict(zip((name.strip() for name in lines[0]), lines[1], strict=False))
    names, table = [name.strip() for name in lines[2]], lines[3:]
    lacking = [name for name in ("time", FORCE, *COP) if name not in names]
    lacking += [name for name in ("frequency", "count") if name not in about]
    if lacking:
        raise ValueError(f"{path}: no column {lacking[0]!r}; it has {', '.join([*about, *names])[:200]}")
    rate, count = (_float(about[name], f"{path}: {name}") for name in ("frequency", "count"))
    if rate != RATE:
        raise ValueError(f"{path}: frequency: expected {RATE:g} Hz, got {rate:g}")
    if len(table) != count:
        raise ValueError(f"{path}: expected {count:g} rows by its count, got {len(table)}: is the file complete?")
    columns = [names.index(name) for name in ("time", FORCE, *COP)]
    numbers = np.array(
        [[_cell(row, column, f"{path}: row {number}") for column in columns] for number, row in enumerate(table)]
    )
    with np.errstate(over="ignore", invalid="ignore"):  # refused below
        maps = np.rint(numbers[:, 0] * rate)
        steps = np.diff(maps)
    if not np.isfinite(maps).all() or (steps != 1).any():
        raise ValueError(f"{path}: time: expected steps of 1/{rate:g} s, without a gap")
    return Trace(maps.astype(np.int64), numbers[:, 1], numbers[:, 2:] / 1000, rate)


def _cell(row: Sequence[str], column: int, place: str) -> float:
    text = row[column].strip() if column < len(row) else ""
    return np.nan if text == "" else _float(text, place)


def _float(text: str, place: str) -> float:
    try:
        return float(text)
    except ValueError:
        raise ValueError(f"{place}: expected a number, got {text[:40]!r}") from None


def corners(path: str | os.PathLike[str]) -> Array:
    """The mat's corners (4, 3) m in the world, in their order: at +x +y, where cell (0, 0) is, +x -y, -x -y, -x +y.

    ValueError, naming the file, without the markers, or if they are no rectangle on the floor.
    """
    points = c3d.read(path).positions(CORNERS)
    points[(points == 0).all(axis=-1)] = np.nan
    if not np.isfinite(points).all(axis=-1).any(axis=0).all():
        raise ValueError(f"{path}: expected the mat's corners {', '.join(CORNERS)}, one was never seen")
    positions = np.nanmedian(points, axis=0)
    if np.abs(positions[:, 2]).max() > 0.1:
        flat = "xyz"[int(np.ptp(positions, axis=0).argmin())]
        hint = f"; looks like {flat} up" if flat != "z" else ""
        raise ValueError(
            f"{path}: expected the mat's corners on the floor z = 0, got z = {positions[:, 2].round(2)} m{hint}"
        )
    side = positions[:, :2] > positions[:, :2].mean(axis=0)
    order = [np.flatnonzero((side == sides).all(axis=1)) for sides in ((1, 1), (1, 0), (0, 0), (0, 1))]
    if any(len(each) != 1 for each in order):
        raise ValueError(
            f"{path}: expected the mat's corners at four corners along x and y, got {positions[:, :2].tolist()}"
        )
    return positions[[int(each[0]) for each in order]]


def place_maps(mat: Mat, outline: Array, path: Path) -> PressureMaps:
    """The maps in the world: the cells are centred in the rectangle of the corner markers, which lie on the rim."""
    first, second, third, fourth = outline
    rows, columns = (second + third - first - fourth) / 2, (third + fourth - first - second) / 2
    sides = np.array([np.linalg.norm(rows), np.linalg.norm(columns)])
    cells = np.array(mat.maps.shape[1:]) * mat.cell
    if np.abs(sides - cells).max() > 0.1:
        raise ValueError(
            f"{path}: expected the mat's corners {cells[0]:.3f} × {cells[1]:.3f} m apart, as its cells are, got "
            f"{sides[0]:.3f} × {sides[1]:.3f} m"
        )
    e1, e2 = rows / sides[0], columns / sides[1]
    origin = outline.mean(axis=0) - (cells[0] * e1 + cells[1] * e2) / 2
    return PressureMaps(mat.maps, origin, e1, e2, mat.cell)


def check_loads(files: SequenceFiles) -> list[Finding]:
    """Whether maps and centres of pressure agree on force and place."""
    try:
        mat, trace = read_maps(files.mat[0]), read_trace(files.mat[1])
        maps = mat.maps[trace.maps].astype(np.float64)
    except (ValueError, IndexError) as error:
        return [Finding("wrong", str(error))]
    force = maps.sum(axis=(1, 2)) * (100 * mat.cell) ** 2
    loaded = (trace.force > 50) & np.isfinite(trace.center).all(axis=1)
    if not loaded.any():
        return [Finding("missing", f"{files.name}: nobody is on the mat")]
    share = float(np.median(force[loaded] / trace.force[loaded]))
    if abs(share - 1) > 0.02:
        return [Finding("wrong", f"{files.name}: the maps add up to {share:.3g} of the force", "are the maps N/cm²?")]
    rows, columns = (np.arange(size) + 0.5 for size in maps.shape[1:])
    total = maps.sum(axis=(1, 2))[loaded]
    center = np.stack([maps[loaded].sum(axis=1) @ columns, maps[loaded].sum(axis=2) @ rows], axis=1) / total[:, None]
    off = float(np.median(np.linalg.norm(center * mat.cell - trace.center[loaded], axis=1)))
    if off > 0.005:
        message = f"{files.name}: the maps' centre is {1e3 * off:.0f} mm from the centre of pressure in the median"
        return [Finding("wrong", message, "are the maps turned or upside down?")]
    return []
