"""Wavefront .obj: vertices and polygons. Colours, normals, textures and materials have no part in a body's physics."""

from __future__ import annotations

import numpy as np

from . import polygons, text
from .repair import Mesh

FREE_FORM = (b"curv", b"curv2", b"surf")


def parse(content: bytes) -> Mesh:
    """The vertices in the file's order, polygons cut into triangles. ValueError, naming the line, for damage."""
    points: list[list[float]] = []
    corners: list[int] = []
    counts: list[int] = []
    objects: dict[bytes, None] = {}  # those that have faces, in order
    current, free_form = b"", 0
    for number, line in enumerate(text.lines(content.replace(b"\\\r\n", b" ").replace(b"\\\n", b" ")), start=1):
        words = line.split()
        if not words:
            continue
        try:
            if words[0] == b"v":
                x, y, z = words[1:4]  # a weight or a colour may follow
                points.append([float(x), float(y), float(z)])
            elif words[0] in (b"f", b"fo"):
                corners.extend(_index(word, len(points)) for word in words[1:])
                counts.append(len(words) - 1)
                objects[current] = None
            elif words[0] == b"o":
                current = b" ".join(words[1:])
            elif words[0] in FREE_FORM:
                free_form += 1
        except ValueError as error:
            comma = "; decimals need a point, not a comma" if words[0] == b"v" and b"," in line else ""
            said = text.listed([line.decode("utf-8", "replace")])
            reason = str(error) if "vertex" in str(error) else "expected numbers"
            raise ValueError(f"line {number}: {reason}, got '{said}'{comma}") from None
    vertices = np.array(points, np.float64).reshape(-1, 3)
    faces = polygons.triangles(np.array(corners, np.int64), np.array(counts, np.int64))
    notes = []
    if len(objects) > 1:
        notes.append(f"{len(objects)} objects are joined: {text.listed([text.name(one) for one in objects])}")
    if free_form:
        notes.append(
            f"{text.counted(free_form, 'free-form curve or surface', 'free-form curves or surfaces')} left out"
        )
    return Mesh(vertices, faces, notes=tuple(notes))


def _index(word: bytes, count: int) -> int:
    """Of a corner such as 7, 7/1 or -1//2: counted from 1, or backwards from the vertices so far."""
    index = int(word.split(b"/", 1)[0])
    place = index - 1 if index > 0 else count + index
    if index == 0 or place < 0:
        raise ValueError(f"there is no vertex {index}")
    return place
