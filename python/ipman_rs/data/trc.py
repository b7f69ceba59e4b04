"""TRC files: tab-separated text of Motion Analysis and OpenSim. They do not say which axis is up; OpenSim's is y."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from .tracks import Tracks, tracks

FIRST_ROW = 5  # after two lines of header fields, their values, the markers' names and their axes


def read(path: str | Path, up: str | None = None) -> Tracks:
    """The markers of a TRC file. ValueError, naming the file and line, for whatever is not right in it."""
    source = str(path)
    try:
        lines = Path(path).read_text(encoding="utf-8", errors="replace").splitlines()
    except OSError as error:
        raise ValueError(f"{source}: {error.strerror}") from None
    if not lines or not lines[0].startswith("PathFileType"):
        raise ValueError(f"{source}: line 1: expected PathFileType, got another text")
    if len(lines) < FIRST_ROW:
        raise ValueError(f"{source}: expected a header of {FIRST_ROW} lines, got {len(lines)}")
    header = dict(zip(lines[1].split("\t"), lines[2].split("\t"), strict=False))
    names = [name.strip() for name in lines[3].split("\t")[2:] if name.strip()]
    rows = [
        _row(line, len(names), f"{source}: line {number}")
        for number, line in enumerate(lines[FIRST_ROW:], FIRST_ROW + 1)
        if line.strip()
    ]
    numbers = np.array(rows).reshape(len(rows), 1 + 3 * len(names))
    points = numbers[:, 1:].reshape(len(rows), len(names), 3)
    return tracks(names, points, numbers[:, 0], header.get("Units", "").strip(), up or "y", source)


def _row(line: str, markers: int, place: str) -> list[float]:
    """The time and the coordinates of a sample; an empty field is NaN."""
    fields = line.rstrip("\r\n").split("\t")[1:]
    width = 1 + 3 * markers
    if any(field.strip() for field in fields[width:]) or len(fields) < 4:
        raise ValueError(f"{place}: expected {width + 1} columns for {markers} markers, got {len(fields) + 1}")
    fields = (fields + [""] * width)[:width]
    try:
        return [float(field) if field.strip() else np.nan for field in fields]
    except ValueError as error:
        raise ValueError(f"{place}: expected numbers: {error}") from None
