"""Bodies from files, and to files: .npz of body parameters or vertices, meshes, and their parts."""

from __future__ import annotations

from .meshes import read_mesh
from .parameters import read_npz
from .recording import Recording
from .write_mesh import glb, obj

__all__ = ["Recording", "glb", "obj", "read_mesh", "read_npz"]
