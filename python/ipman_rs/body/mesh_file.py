"""Reads the vertices of a person's own mesh, which are in the order of the body model."""

from __future__ import annotations

import os
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ..files.mesh.read_mesh import read_points

ENDINGS = (".ply", ".obj")
SPAN = (0.25, 3.5)  # m, of a body's longest side


def vertices(path: str | os.PathLike[str]) -> NDArray[np.float64]:
    """The vertices (V, 3) m of a .ply or .obj file, in its own order. ValueError, naming the file, for one that is
    missing, damaged, of another kind, or not in metres."""
    place = Path(path)
    if place.suffix.lower() not in ENDINGS or not place.is_file():
        what = "no such file" if not place.is_file() else f"a file {place.suffix or 'without ending'}"
        raise ValueError(f"{path}: expected a mesh in a .ply or .obj file, got {what}")
    points = read_points(place)
    span = float(np.ptp(points, axis=0).max())
    if not SPAN[0] <= span <= SPAN[1]:
        hint = "; looks like millimetres" if span > 100 else ""
        raise ValueError(f"{path}: expected a body in metres, got one that spans {span:.4g}{hint}")
    return points
