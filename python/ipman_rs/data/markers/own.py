"""A user's own marker names: a file that says which place on the body each of them means."""

from __future__ import annotations

import csv
from collections import Counter
from pathlib import Path
from typing import Any

from ipman_rs.body import BodyModel
from ipman_rs.files import read_bytes, read_json, read_yaml

from .names import comparable, meanings
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
    place_names = places(body)
    if isinstance(place, str):
        word = place.strip().lower().replace(" ", "_").replace("-", "_")
        if word in place_names:
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
    pairs = {".csv": _of_csv, ".json": _of_json}.get(ending, _of_yaml)(path)
    if not pairs:
        raise ValueError(f"{path}: expected names of markers and their places, got none")
    earlier: dict[str, tuple[str, Any]] = {}
    for name, place in pairs:
        other, meant = earlier.setdefault(comparable(name), (name, place))
        if meant != place:
            raise ValueError(f"{path}: {name!r}: expected one place, got {meant!r} for {other!r} and {place!r}")
    return dict(pairs)


def _of_json(path: Path) -> list[tuple[str, Any]]:
    content = read_json(path, pairs=tuple)
    if not isinstance(content, tuple):
        raise ValueError(f"{path}: expected an object of marker names and places, got {type(content).__name__}")
    return list(content)


def _of_yaml(path: Path) -> list[tuple[str, Any]]:
    import yaml

    content = read_yaml(path)
    if content is not None and not isinstance(content, dict):
        raise ValueError(f"{path}: expected an object of marker names and places, got {type(content).__name__}")
    names = [key.value for key, _ in getattr(yaml.compose(read_bytes(path, LARGEST)), "value", [])]
    twice = [name for name, count in Counter(names).items() if count > 1]
    if twice:
        raise ValueError(f"{path}: {twice[0]!r}: expected one place, got the name twice")
    return [(str(name), place) for name, place in (content or {}).items()]


def _of_csv(path: Path) -> list[tuple[str, Any]]:
    """Two columns, which commas, semicolons or tabs part: the first of them that parts every row."""
    try:
        text = read_bytes(path, LARGEST).decode("utf-8-sig")
    except UnicodeDecodeError:
        raise ValueError(f"{path}: expected text in UTF-8") from None
    lines = [line for line in text.splitlines() if line.strip()]
    mark = next((mark for mark in ",;\t" if all(mark in line for line in lines)), ",")
    rows = [[cell.strip() for cell in row] for row in csv.reader(lines, delimiter=mark)]
    rows = [row for row in rows if any(row)]
    if rows and rows[0][0].lower() in ("marker", "name") and rows[0][-1].lower() in ("place", "site"):
        rows = rows[1:]
    for number, row in enumerate(rows, 1):
        if len(row) != 2:
            raise ValueError(f"{path}: row {number}: expected a marker's name and its place, got {len(row)} columns")
    return [(row[0], row[1]) for row in rows]
