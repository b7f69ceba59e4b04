"""What a file holds: one body, or a body over time, with its surface."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from ..body.sequence import PosedSequence
from ..data.check import Finding

Y_UP, Z_UP = (0.0, 1.0, 0.0), (0.0, 0.0, 1.0)


@dataclass(frozen=True)
class BodySequence:
    """``vertices`` (T, V, 3) m, or bodies that are posed when they are needed, and ``faces`` (F, 3).

    ``template`` when the file's body model has one; ``vertex_map`` (N,) the vertex that each vertex of the file became,
    −1 for those left out, and ``face_map`` (F,) the triangle of the file that each face was, where the mesh was
    repaired; ``seconds`` (T,) of a sequence; ``up`` what the file's kind has pointing up, ``up_why`` why.
    ``unused``: names of arrays of the file that were not read; ``findings``: what its reader judged, and ``flags``, in
    words, what is odd about its bodies.
    """

    path: Path
    vertices: np.ndarray | PosedSequence
    faces: np.ndarray
    template: Any = None
    vertex_map: np.ndarray | None = None
    face_map: np.ndarray | None = None
    seconds: np.ndarray | None = None
    up: tuple[float, float, float] = Y_UP
    up_why: str = ""
    notes: tuple[str, ...] = ()
    unused: tuple[str, ...] = ()
    findings: tuple[Finding, ...] = ()
    flags: tuple[str, ...] = ()

    @property
    def up_name(self) -> str:
        return "z" if self.up == Z_UP else "y"
