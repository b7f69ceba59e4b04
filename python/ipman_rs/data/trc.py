"""TRC files: text of Motion Analysis (Cortex, EVaRT), OpenSim, OpenCap and others, whose columns tabs or blanks part.

They do not say which axis is up; OpenSim's is y. Frame, time, then x, y and z of each marker; an empty column between
two tabs is a coordinate that was not measured, but tabs that are doubled throughout part columns as single ones do.
Spreadsheets part the columns by semicolons or commas.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from . import text_file
from .tracks import Tracks, rate_of, tracks

HEADER = 5  # lines: two of header fields, their values, the markers' names, their axes
LEAST = 4  # columns of a row: frame, time and something of a marker
FRAME = re.compile(r"frames?\s*(?:#|no\.?|nr\.?|number)?", re.IGNORECASE)
TIME = re.compile(r"time\s*[(\[]?\s*(?:s|secs?|seconds)?\s*[)\]]?", re.IGNORECASE)
HEADINGS = re.compile(rf"\s*{FRAME.pattern}(?:\s+{TIME.pattern}(?=\s)|(?=\s))|\s*{TIME.pattern}(?=\s)", re.IGNORECASE)
X_AXIS = re.compile(r"x\d+", re.IGNORECASE)
UNLIKE = 0.01  # of the rate: that far the header's may be from the times'


def read(
    path: str | Path,
    up: str | None = None,
    subject: str | None = None,
    unit: float | None = None,
    rate: float | None = None,
) -> Tracks:
    """The markers of a TRC file, of `subject` where its names have one before a colon ("S01:LASI").

    ValueError, naming the file and line, for whatever is not right in it.
    """
    source = str(path)
    lines = text_file.lines(path)
    if not lines or not lines[0].strip().lower().startswith("pathfiletype"):
        raise ValueError(f"{source}: line 1: expected PathFileType, got another text")
    if len(lines) < HEADER:
        raise ValueError(f"{source}: expected a header of {HEADER} lines, got {len(lines)}")
    head = next((row for row, line in enumerate(lines[:20]) if line.strip().lower().startswith("frame")), 3)
    if mark := _mark(lines[head]):
        lines = [line.replace(mark, "\t") for line in lines]
    header, notes = _header(lines[1:head]), []
    rows = [(number, line) for number, line in enumerate(lines[head + 1 :], head + 2) if line.strip()]
    axes = rows.pop(0)[1] if rows and not _is_number(rows[0][1].split()[0]) else ""  # X1, Y1, Z1, …
    names, table = _table_of(rows, _names(lines[head], axes), header, source)
    if table.markers > len(names):
        more = table.markers - len(names)
        notes.append(f"{more} {'marker' if more == 1 else 'markers'} without a name behind the named ones left out")
    if table.short:
        notes.append(f"{table.short} rows end before the last marker; what they lack is taken as not seen")
    numbers = text_file.table(table.rows, [f"{source}: line {number}" for number in table.lines])
    numbers = numbers.reshape(len(table.rows), 1 + 3 * table.markers)
    times = (
        text_file.seconds(numbers[:, 0], table.lines, source, notes) if rate is None else np.arange(len(numbers)) / rate
    )
    points = numbers[:, 1 : 1 + 3 * len(names)].reshape(len(times), len(names), 3)
    _compare(header, times, notes)
    file_unit = header.get("units", "") if unit is None else unit
    return tracks(names, points, times, file_unit, up or "y", source, subject=subject, notes=notes)


def _mark(names: str) -> str:
    """What parts the columns instead of tabs and blanks, as spreadsheets write it: a semicolon or a comma; or ""."""
    return next((mark for mark in ";," if "\t" not in names and names.count(mark) > 2), "")


def _header(lines: Sequence[str]) -> dict[str, str]:
    """What the header says, by the fields' names in lower case; the unit may be blank."""
    filled = [line for line in lines if line.strip()]
    if len(filled) < 2:
        return {}
    for part in (lambda line: line.rstrip("\r\n").split("\t"), str.split):
        fields, values = part(filled[0]), part(filled[1])
        while fields and not fields[-1].strip():
            fields.pop()
        if len(fields) == len(values) or (len(fields) > 1 and not "".join(values[len(fields) :]).strip()):
            pairs = {field.strip().lower(): value.strip() for field, value in zip(fields, values, strict=False)}
            if not _is_number(pairs.get("units", "")):
                return pairs
    words = [value for value in filled[1].split() if not _is_number(value)]
    return {"units": words[0] if words else ""}


def _is_number(text: str) -> bool:
    try:
        return np.isfinite(text_file.number(text))
    except ValueError:
        return False


def _names(line: str, axes: str) -> tuple[list[str], list[str]]:
    """The markers' names: by the places of their columns, "" of one without a name; and those that are not blank.

    `axes`: the line below, "" of a file without one, whose X1, X2, … stand in the columns in which markers begin.
    """
    cells = [cell.strip() for cell in line.rstrip().split("\t")]
    begins = [place for place, cell in enumerate(axes.rstrip().split("\t")) if X_AXIS.fullmatch(cell.strip())]
    filled = [place for place, cell in enumerate(cells) if cell]
    if begins and {place for place in filled if place >= begins[0]} <= set(begins) and len(cells) > begins[0]:
        placed = [cells[place] for place in begins if place < len(cells)]
        return placed, [name for name in placed if name]
    if len(filled) < 3:
        words = HEADINGS.sub("", line).split() if HEADINGS.match(line) else line.split()[2:]
        return words, words
    filled = filled[_headings([cells[place] for place in filled], filled, len(begins)) :]
    places = cells[filled[0] :]
    names = [cell for cell in places if cell]
    if any(places[place] for place in range(len(places)) if place % 3):  # a column a name, or tabs as they came
        return names, names
    return places[::3], names


def _headings(cells: list[str], places: list[int], markers: int) -> int:
    """How many of a line's cells, which stand at these places, are Frame# and Time; of `markers`, 0 if unknown."""
    frame = int(FRAME.fullmatch(cells[0]) is not None)
    recognised = frame + (TIME.fullmatch(cells[frame]) is not None)
    if markers:  # in other words
        return max(recognised, min(2, len(cells) - markers))
    return max(recognised, sum(place < 2 for place in places[:2]))


@dataclass(frozen=True)
class _Table:
    """Rows of time and three coordinates of each marker, as text; `markers` of them, the unnamed ones last."""

    rows: list[list[str]]
    lines: list[int]
    markers: int
    short: int  # rows that end before the last marker


def _table_of(
    rows: Sequence[tuple[int, str]], names: tuple[list[str], list[str]], header: dict[str, str], source: str
) -> tuple[list[str], _Table]:
    """The names, of two readings of them, and the rows that go together."""
    by_place, filled = names
    declared = header.get("nummarkers", "")
    count = int(float(declared)) if _is_number(declared) else None
    try:
        return by_place, _table(rows, len(by_place), count, source)
    except ValueError:
        if filled == by_place:
            raise
        return filled, _table(rows, len(filled), count, source)


def _table(rows: Sequence[tuple[int, str]], markers: int, declared: int | None, source: str) -> _Table:
    """`markers` have names, `said` are in the file by its header."""
    width = 2 + 3 * markers
    split, tabs = _split([line for _, line in rows], width)
    widest = max(map(len, split), default=width)
    for (number, _), cells in zip(rows, split, strict=True):
        wrong = len(cells) < (LEAST if tabs else width) or (
            widest > width and (len(cells) < widest or (widest - width) % 3)
        )
        expected = f"expected {width} columns for {markers} markers"
        if wrong or (widest < width and declared != markers):
            raise ValueError(f"{source}: line {number}: {expected}, got {len(cells)}")
    whole = max(widest, width)
    filled = [[cell.strip() or "nan" for cell in [*cells[1:], *[""] * (whole - len(cells))]] for cells in split]
    short = sum(len(cells) < width for cells in split)
    return _Table(filled, [number for number, _ in rows], (whole - 2) // 3, short)


def _split(lines: Sequence[str], width: int) -> tuple[list[list[str]], bool]:
    """The columns of each row, and whether single tabs part them, or blanks: tabs doubled, mixed with blanks, missing.

    Tabs are believed where the empty columns between them are whole markers that were not seen, or every second one:
    those are doubled, for no row is without its time.
    """
    cells = [line.rstrip("\r\n").split("\t") for line in lines]
    doubled = all(len(row) > 1 and not "".join(row[1::2]).strip() for row in cells)
    by_tabs = [_trimmed(row[::2] if doubled else row, width) for row in cells]
    widest = max(map(len, by_tabs), default=width)
    fits = all(len(cells) >= LEAST for cells in by_tabs) and (widest <= width or (widest - width) % 3 == 0)
    if fits and all(_whole(cells) for cells in by_tabs):
        return by_tabs, True
    by_blanks = [line.split() for line in lines]
    counts = {len(words) for words in by_blanks}
    if len(counts) == 1 and (count := counts.pop()) >= width and (count - width) % 3 == 0:
        return by_blanks, False
    tabs = any("\t" in line for line in lines)
    return (by_tabs if tabs else by_blanks), tabs


def _trimmed(cells: list[str], width: int) -> list[str]:
    """Without empty columns behind the `width` that are meant."""
    while len(cells) > width and not cells[-1].strip():
        cells.pop()
    return cells


def _whole(cells: list[str]) -> bool:
    """Whether no marker has some of its coordinates only."""
    empty = [not cell.strip() for cell in cells[2:]]
    return all(len(set(empty[at : at + 3])) == 1 for at in range(0, len(empty), 3))


def _compare(header: dict[str, str], times: np.ndarray, notes: list[str]) -> None:
    """Notes of what the header says otherwise than the rows."""
    frames, rate = header.get("numframes", ""), header.get("datarate", "")
    if _is_number(frames) and float(frames) != len(times):
        notes.append(f"its header says {frames} frames, it has {len(times)}")
    own = rate_of(times)
    if _is_number(rate) and float(rate) > 0 and own and abs(own / float(rate) - 1) > UNLIKE:
        notes.append(f"its header says {rate} Hz, its times say {own:.4g} Hz; the times are believed")
