"""Mesh files as recordings of one body."""

from __future__ import annotations

from pathlib import Path

from ..files.errors import FileError
from ..files.mesh import read_mesh as io
from .body_sequence import BodySequence


def read_mesh(path: Path) -> BodySequence:
    """The surface of a mesh file. Raises FileError."""
    if path.suffix.lower() not in io.ENDINGS:
        kind = path.suffix.lower() or "without ending"
        raise FileError(path, f"unknown kind {kind!r}; expected {' '.join(io.ENDINGS)} or .npz")
    try:
        mesh = io.read_mesh(path)
    except ValueError as error:
        raise FileError(path, str(error)) from error
    return BodySequence(
        path, mesh.vertices[None], mesh.faces, vertex_map=mesh.vertex_map, face_map=mesh.face_map, notes=mesh.notes
    )
