"""Read mesh files with trimesh, keeping the order of their vertices."""

from __future__ import annotations

import logging
from pathlib import Path

import numpy as np

from .errors import FileError
from .recording import Recording

ENDINGS = (".obj", ".ply", ".glb", ".stl")


def read_mesh(path: Path) -> Recording:
    """The mesh of an .obj, .ply, .glb or .stl file, its scene's nodes joined. Raises FileError."""
    kind = path.suffix.lower()
    if kind not in ENDINGS:
        raise FileError(path, f"unknown kind {kind or 'without ending'!r}; expected {' '.join(ENDINGS)} or .npz")
    vertices, faces = _load(path, kind)
    if len(vertices) == 0 or len(faces) == 0:
        raise FileError(path, f"holds {len(vertices)} vertices and {len(faces)} faces, no surface; export it again")
    vertices, faces, merged = join_seams(vertices, faces)
    notes = () if merged is None else (f"{len(merged) - len(vertices)} vertices that lie on each other were merged",)
    return Recording(path, vertices[None], faces, vertex_map=merged, notes=notes)


def _load(path: Path, kind: str) -> tuple[np.ndarray, np.ndarray]:
    import trimesh

    logging.getLogger("trimesh").setLevel(logging.CRITICAL)
    try:
        with path.open("rb") as stream:
            _check_claims(path, stream.read(65536))
            stream.seek(0)
            scene = trimesh.load_scene(
                stream, file_type=kind[1:], process=False, maintain_order=True, skip_materials=True
            )  # fmt: skip
        mesh = scene.to_mesh()
        return np.asarray(mesh.vertices, dtype=np.float64), np.asarray(mesh.faces, dtype=np.int64)
    except FileError:
        raise
    except Exception as error:  # damaged bytes fail in any way in any of the parsers
        reason = f"{type(error).__name__}: {error}" if str(error) else type(error).__name__
        raise FileError(path, f"is no readable {kind} mesh ({reason[:160]}); export it again") from error


def _check_claims(path: Path, head: bytes) -> None:
    """Refuse a .ply that claims more elements than it has bytes: a parser would ask for the memory first."""
    if not head.startswith(b"ply"):
        return
    for line in head.split(b"end_header")[0].splitlines():
        words = line.split()
        if len(words) == 3 and words[0] == b"element" and words[2].isdigit() and int(words[2]) > path.stat().st_size:
            claim = f"{words[2].decode()[:20]} of {words[1].decode(errors='replace')[:20]}"
            raise FileError(path, f"claims {claim} but has only {path.stat().st_size} bytes; is the download complete?")


def join_seams(vertices: np.ndarray, faces: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray | None]:
    """Merge vertices at equal places where faces do not share them (STL, texture seams); closed meshes are left alone.

    Returns vertices, faces and, where something was merged, the new index of each old vertex.
    """
    if not ((faces >= 0) & (faces < len(vertices))).all():
        return vertices, faces, None
    edges = np.sort(faces[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2), axis=1)
    _, uses = np.unique(edges, axis=0, return_counts=True)
    if (uses > 1).all():
        return vertices, faces, None
    _, first, inverse = np.unique(vertices + 0.0, axis=0, return_index=True, return_inverse=True)
    if len(first) == len(vertices):
        return vertices, faces, None
    # Numbered by first appearance, so that the order of the file stays recognisable.
    order = np.argsort(first)
    rank = np.empty_like(order)
    rank[order] = np.arange(len(order))
    merged = rank[inverse.reshape(-1)]
    return vertices[first[order]], merged[faces], merged
