"""Bodies from files, and to files: .npz of body parameters or vertices, meshes, and their parts."""

from __future__ import annotations

from ..renamed import old_names
from .body_sequence import BodySequence
from .meshes import read_mesh
from .parameters import read_npz
from .write_mesh import glb, obj

__all__ = ["BodySequence", "glb", "obj", "read_mesh", "read_npz"]

__getattr__ = old_names(__name__, {"Recording": "BodySequence"})
