"""Meshes from .obj, .ply, .stl, .glb and .gltf files, in the order of their vertices."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ipman_rs.files import regular_file

from . import gltf, obj, ply, repair, stl
from .repair import Mesh

PARSERS = {".obj": obj.parse, ".ply": ply.parse, ".stl": stl.parse}
ENDINGS = (*PARSERS, ".glb", ".gltf")


def read_mesh(path: Path) -> Mesh:
    """The surface in a file: what it holds is joined, posed by its skin, and repaired where a note says so.

    ValueError, naming the file, for what is missing, damaged, of another kind, or no surface.
    """
    mesh = _parse(path)
    if not len(mesh.vertices) or not len(mesh.faces):
        count = len(mesh.vertices)
        what = f"it is a point cloud of {count} vertices and no faces" if count else "it is empty"
        raise _unreadable(path, f"{what}, no surface; reconstruct one (MeshLab) or export the mesh")
    try:
        return repair.repair_mesh(mesh)
    except ValueError as error:
        raise _unreadable(path, str(error)) from error


def read_points(path: Path) -> NDArray[np.float64]:
    """All vertices (V, 3) of a file, with or without faces. ValueError, naming the file."""
    mesh = _parse(path)
    if not len(mesh.vertices) or not np.isfinite(mesh.vertices).all():
        raise _unreadable(path, f"expected finite vertices, got {len(mesh.vertices)}")
    return mesh.vertices


def _parse(path: Path) -> Mesh:
    kind = path.suffix.lower()
    if kind not in ENDINGS:
        raise ValueError(f"{path}: unknown kind {kind or 'without ending'!r}; expected {' '.join(ENDINGS)}")
    regular_file(path)
    try:
        content = path.read_bytes()
        return PARSERS[kind](content) if kind in PARSERS else gltf.parse(content, path.parent)
    except MemoryError:
        raise
    except ValueError as error:
        raise _unreadable(path, str(error)) from error
    except KeyError as error:
        raise _unreadable(path, f"it lacks {str(error)[:80]}") from error
    except OverflowError as error:
        raise _unreadable(path, "it holds a number larger than any that is counted with") from error
    except Exception as error:  # damaged bytes fail in any way
        raise _unreadable(path, "an entry of it is of another kind than such a file has") from error


def _unreadable(path: Path, reason: str) -> ValueError:
    advice = "" if ";" in reason else "; export it again"
    return ValueError(f"{path}: is no readable {path.suffix.lower()} mesh: {reason}{advice}")
