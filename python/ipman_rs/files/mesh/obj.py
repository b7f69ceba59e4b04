"""Wavefront .obj: vertices and polygons. Colours, normals, textures and materials have no part in a body's physics."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from . import polygons, text
from .repair import Mesh

FREE_FORM = (b"curv", b"curv2", b"surf")


def parse(content: bytes) -> Mesh:
    """The vertices in the file's order, polygons cut into triangles. ValueError, naming the line, for damage."""
    points: list[float] = []  # x, y, z of one after the other: millions of small lists would take half of the time
    corners: list[int] = []  # as the file numbers them
    counts: list[int] = []  # of each polygon
    before: list[int] = []  # vertices before each polygon
    objects: dict[bytes, None] = {}  # those that have faces, in order
    current, free_form = b"", 0
    for number, line in enumerate(text.lines(content.replace(b"\\\r\n", b" ").replace(b"\\\n", b" ")), start=1):
        words = line.split()
        if not words:
            continue
        try:
            if words[0] == b"v":
                x, y, z = words[1:4]  # a weight or a colour may follow
                points.extend((float(x), float(y), float(z)))
            elif words[0] in (b"f", b"fo"):
                del words[0]
                if b"/" in line:  # texture and normal: 7/1, 7//2
                    words = [word.split(b"/", 1)[0] for word in words]
                corners.extend(map(int, words))
                counts.append(len(words))
                before.append(len(points) // 3)
                objects[current] = None
            elif words[0] == b"o":
                current = b" ".join(words[1:])
            elif words[0] in FREE_FORM:
                free_form += 1
        except ValueError:
            shown = text.list_names([line.decode("utf-8", "replace")])
            comma = "; decimals need a point, not a comma" if b"," in line else ""
            raise ValueError(f"line {number}: expected numbers, got '{shown}'{comma}") from None
    vertices = np.array(points, np.float64).reshape(-1, 3)
    sizes = np.array(counts, np.int64)
    indices = _from_zero(np.array(corners, np.int64), np.repeat(np.array(before, np.int64), sizes))
    faces = polygons.triangles(indices, sizes)
    notes = []
    if len(objects) > 1:
        notes.append(f"{len(objects)} objects are joined: {text.list_names([text.name(one) for one in objects])}")
    if free_form:
        notes.append(f"{text.count_of(free_form, 'free-form element')} (curves, surfaces) left out")
    return Mesh(vertices, faces, notes=tuple(notes))


def _from_zero(corners: NDArray[np.int64], before: NDArray[np.int64]) -> NDArray[np.int64]:
    """Numbers from 0 of those that count from 1, or backwards from the vertices before."""
    if (corners == 0).any():
        raise ValueError("a face names vertex 0, but .obj files count from 1")
    return np.where(corners > 0, corners - 1, corners + before)
