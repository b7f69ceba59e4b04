"""Stereolithography .stl, binary and text: triangles that share no vertices until equal corners are merged."""

from __future__ import annotations

import numpy as np

from . import text
from .repair import Mesh

HEADER, FACET = 84, 50  # bytes
RECORD = np.dtype([("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("attribute", "<u2")])


def parse(content: bytes) -> Mesh:
    """Three vertices for each triangle. ValueError for damage."""
    count = int.from_bytes(content[80:84], "little") if len(content) >= HEADER else 0
    whole = HEADER + FACET * count
    # Some programs begin the binary form with "solid", too: then its length tells.
    is_text = content[:1024].removeprefix(b"\xef\xbb\xbf").lstrip().lower().startswith(b"solid")
    if is_text and len(content) != whole:
        return _text(content)
    if len(content) < HEADER:
        raise ValueError(f"it has {len(content)} bytes, too few for a header")
    if len(content) < whole:
        raise ValueError(f"it claims {count} triangles but has only {len(content)} bytes; is the download complete?")
    corners = np.frombuffer(content, RECORD, count, HEADER)["corners"]
    more = len(content) - whole
    notes = (f"{more} bytes behind the {count} triangles left out",) if more else ()
    return _soup(corners.astype(np.float64).reshape(-1, 3), notes)


def _text(content: bytes) -> Mesh:
    corners: list[list[float]] = []
    solids: list[str] = []
    ended, started = True, 0
    for number, line in enumerate(text.lines(content), start=1):
        words = line.lower().split()
        if not words:
            continue
        if words[0] == b"vertex":
            try:
                x, y, z = map(float, words[1:4])
            except ValueError:
                shown = text.list_names([line.decode("utf-8", "replace")])
                comma = "; decimals need a point, not a comma" if b"," in line else ""
                raise ValueError(f"line {number}: expected three numbers, got '{shown}'{comma}") from None
            corners.append([x, y, z])
        elif words[0] == b"solid":
            solids.append(text.name(b" ".join(line.split()[1:])))
            ended = False
        elif words[0] == b"endsolid":
            ended = True
        elif words[0] == b"facet":
            started = len(corners)
        elif words[0] == b"endfacet" and len(corners) != started + 3:
            raise ValueError(f"line {number}: expected a triangle, got {len(corners) - started} corners")
    if not ended or len(corners) % 3:
        raise ValueError("it ends within a solid; is the download complete?")
    notes = (f"{len(solids)} solids are joined: {text.list_names(solids)}",) if len(solids) > 1 else ()
    return _soup(np.array(corners, np.float64).reshape(-1, 3), notes)


def _soup(vertices: np.ndarray, notes: tuple[str, ...]) -> Mesh:
    return Mesh(vertices, np.arange(len(vertices)).reshape(-1, 3), notes=notes)
