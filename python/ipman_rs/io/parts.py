"""The parts of a mesh: from a file, or from the body model that has the same topology."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from ..files import read_json, regular_file, safe_npz
from ..files.errors import FileError

if TYPE_CHECKING:
    from ..body import BodyModel

_HELP = "expected JSON {part: [vertex ids]}, or one label a face as .json, .npy or .npz (face_parts)"


def read_parts(
    path: Path, faces: np.ndarray, vertex_map: np.ndarray | None, face_map: np.ndarray | None = None
) -> tuple[np.ndarray, tuple[str, ...]]:
    """Labels (F,) and part names from a file. ``vertex_map`` takes the mesh file's vertex ids to those of ``faces``,
    −1 to none; ``face_map`` (F,) is the mesh file's triangle of each face."""
    try:
        return _read(path, faces, vertex_map, face_map)
    except ValueError as error:
        raise FileError(path, f"{error}; {_HELP}") from error


def _read(
    path: Path, faces: np.ndarray, vertex_map: np.ndarray | None, face_map: np.ndarray | None
) -> tuple[np.ndarray, tuple[str, ...]]:
    regular_file(path)
    names: list[str] | None = None
    if path.suffix.lower() == ".json":
        content = read_json(path)
        if isinstance(content, dict):
            return _from_vertices(path, content, faces, vertex_map)
        labels = _labels(path, content)
    elif path.suffix.lower() == ".npz":
        stored = safe_npz.names(path)
        if "face_parts" not in stored:
            raise FileError(path, f"holds {', '.join(sorted(stored))[:100]}, no face_parts; {_HELP}")
        labels = _labels(path, safe_npz.read(path, "face_parts"))
        names = safe_npz.read(path, "part_names").astype(str).ravel().tolist() if "part_names" in stored else None
    elif path.suffix.lower() == ".npy":
        labels = _labels(path, safe_npz.read_npy(path))
    else:
        raise FileError(path, _HELP)
    if face_map is not None and len(labels) > face_map.max():
        labels = labels[face_map]
    if len(labels) != len(faces):
        raise FileError(path, f"has {len(labels)} labels for {len(faces)} faces; expected one label a face")
    used, labels = np.unique(labels, return_inverse=True)
    if names is None or used.max() >= len(names) or used.min() < 0:
        return labels, tuple(f"part {label}" for label in used)
    return labels, tuple(names[label] for label in used)


def _labels(path: Path, content: Any) -> np.ndarray:
    try:
        labels = np.asarray(content)
    except ValueError:
        labels = np.empty((0, 0))
    largest = np.iinfo(np.int64).max
    if labels.ndim != 1 or labels.dtype.kind not in "iu" or len(labels) == 0 or labels.max() > largest:
        raise FileError(path, f"holds no list of whole numbers; {_HELP}")
    return labels.astype(np.int64)


def _from_vertices(
    path: Path, content: dict[str, Any], faces: np.ndarray, vertex_map: np.ndarray | None
) -> tuple[np.ndarray, tuple[str, ...]]:
    """A face belongs to the part that has most of its vertices; faces of no part make a part "rest"."""
    count = int(faces.max()) + 1 if vertex_map is None else len(vertex_map)
    votes = np.zeros((len(faces), len(content) + 1))
    votes[:, -1] = 0.5
    for part, (name, value) in enumerate(content.items()):
        ids = _labels(path, value)
        if ids.min() < 0 or ids.max() >= count:
            bad = ids[(ids < 0) | (ids >= count)][0]
            raise FileError(path, f"part {name!r} names vertex {bad} of {count}; is it the file of another mesh?")
        ids = ids if vertex_map is None else vertex_map[ids]
        member = np.zeros(int(faces.max()) + 1, dtype=bool)
        member[ids[ids >= 0]] = True
        votes[:, part] = member[faces].sum(axis=1)
    used, labels = np.unique(votes.argmax(axis=1), return_inverse=True)
    names = (*map(str, content), "rest")
    return labels, tuple(names[part] for part in used)


def match_body(faces: np.ndarray, num_vertices: int, model: str) -> BodyModel | None:
    """The body model, the asked one or an embedded one, whose faces these are."""
    import ipman_rs as ip

    for name in dict.fromkeys((model, "anny", "anny-lite")):
        body = ip.load_body(name)
        if body.num_vertices == num_vertices and np.array_equal(body.faces, faces):
            return body
    return None
