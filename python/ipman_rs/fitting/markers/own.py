"""A user's own marker names: a file that says which place on the body each of them means."""

from __future__ import annotations

import csv
from pathlib import Path
from typing import Any

from ipman_rs.body import BodyModel
from ipman_rs.files import read_bytes, read_json, read_yaml

from .names import meanings
from .sets import Meaning

LARGEST = 1_000_000  # bytes
ENDINGS = (".json", ".yaml", ".yml", ".csv")


def read(path: Path, body: BodyModel) -> dict[str, Meaning | None]:
    """Names of markers and what they mean, from a JSON or YAML object or a CSV file of two columns.

    A place is one of `places(body)`, or the name of a marker of a known set ("LASI"); none (null, an empty cell) leaves
    the marker out. ValueError, naming the file and
    the marker, for another one.
    """
    pairs = _pairs(path)
    return {name: _meaning(f"{path}: {name!r}", place, body) for name, place in pairs.items()}


def _meaning(what: str, place: Any, body: BodyModel) -> Meaning | None:
    from . import places

    if place is None or place == "":
        return None
    known = places(body)
    if isinstance(place, str):
        word = place.strip().lower().replace(" ", "_").replace("-", "_")
        if word in known:
            return word
        other = meanings([place.strip()])
        if other:
            return other[place.strip()]
    raise ValueError(
        f"{what}: expected a place on the body, such as left_asis or LASI, got {place!r}; "
        "`ipman fit --marker-places` lists all"
    )


def _pairs(path: Path) -> dict[str, Any]:
    ending = path.suffix.lower()
    if ending not in ENDINGS:
        raise ValueError(f"{path}: expected a file of marker names ({', '.join(ENDINGS)})")
    if ending == ".csv":
        pairs = _rows(path, read_bytes(path, LARGEST))
    else:
        content = read_json(path) if ending == ".json" else read_yaml(path)
        if content is not None and not isinstance(content, dict):
            what = type(content).__name__
            raise ValueError(f"{path}: expected an object of marker names and places, got {what}")
        pairs = {str(name): place for name, place in (content or {}).items()}
    if not pairs:
        raise ValueError(f"{path}: expected names of markers and their places, got none")
    return pairs


def _rows(path: Path, data: bytes) -> dict[str, Any]:
    try:
        text = data.decode("utf-8-sig")
    except UnicodeDecodeError:
        raise ValueError(f"{path}: expected text in UTF-8") from None
    rows = [[cell.strip() for cell in row] for row in csv.reader(text.splitlines())]
    rows = [row for row in rows if any(row)]
    if rows and rows[0][0].lower() in ("marker", "name") and rows[0][-1].lower() in ("place", "site"):
        rows = rows[1:]
    for number, row in enumerate(rows, 1):
        if len(row) != 2:
            raise ValueError(f"{path}: row {number}: expected a marker's name and its place, got {len(row)} columns")
    return {row[0]: row[1] for row in rows}
