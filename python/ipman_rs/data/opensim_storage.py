"""Tables of OpenSim's programs, `.mot` and `.sto`: columns by name over time."""

from __future__ import annotations

import os
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from . import text_file
from .check import first_names

Array = NDArray[np.float64]


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
            raise ValueError(
                f"{self.source}: no column {missing[0]!r}; it has {first_names([*self.columns]) or 'none'}"
            )
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
        problem = f"the column {twice!r} twice" if twice else f"{labels[0]!r} first"
        raise ValueError(f"{path}: line {rows[0][0]}: expected the time first and different names, got {problem}")
    cut = len(table) > 1 and _is_cut(table[-1][1], len(labels))
    whole = table[:-1] if cut else table
    numbers, spread = _numbers(str(path), whole, len(labels)), list[str]()
    if not len(numbers):
        raise ValueError(f"{path}: expected rows of numbers, got none")
    times = text_file.seconds(numbers[:, 0], [number for number, _ in whole], str(path), spread)
    declared = _said(header)
    notes = [
        f"its header says {declared[name]} {name}, it has {got}"
        for name, got in (("rows", len(table)), ("columns", len(labels)))
        if name in declared and declared[name] != got
    ]
    notes += [f"the last line, {table[-1][0]}, is cut short and left out: is the file complete?"] if cut else []
    degrees = {"yes": True, "no": False}.get(str(declared.get("indegrees", "")).lower())
    columns = dict(zip(labels[1:], numbers.T[1:], strict=True))
    return Storage(times, columns, degrees, str(path), (*notes, *spread))


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


def _is_cut(fields: list[str], width: int) -> bool:
    """Whether a last row ends before its last column, or within the number there."""
    if len(fields) != width:
        return len(fields) < width
    try:
        text_file.number(fields[-1])
    except ValueError:
        return True
    return False


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
    declared: dict[str, int | str] = {}
    for line in header:
        key, _, value = line.strip().replace("=", " ", 1).partition(" ")
        key, value = key.lower().removeprefix("n").removeprefix("data"), value.strip()
        if key in ("rows", "columns") and value.isdecimal():
            declared[key] = (
                int(value) if len(value) <= 18 else f"{value[:12]}…"
            )  # Python refuses to read thousands of digits
        elif key == "indegrees":
            declared[key] = value
    return declared
