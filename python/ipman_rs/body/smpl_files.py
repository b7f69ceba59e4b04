"""Model files in the formats of SMPL (24 joints), SMPL+H (52) and SMPL-X (55), as `.npz` or `.pkl`."""

from __future__ import annotations

import re
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..files import safe_npz, safe_pickle
from . import joints
from .hands import JOINTS_PER_HAND, Hands
from .model import BodyModel

EXPRESSIONS = 10
FULL_SHAPE_SPACE = 300  # SMPL-X files with all components: 300 of shape, then 100 of expression
FULL_EXPRESSION_SPACE = 100
HAND_KEYS = ("hands_meanl", "hands_meanr", "hands_componentsl", "hands_componentsr")

Read = Callable[[str, tuple[int, ...]], NDArray[Any]]


def load(
    path: Path,
    num_betas: int = 10,
    flat_hand_mean: bool = False,
    v_template: NDArray[np.float64] | None = None,
) -> BodyModel:
    """The body model in `path`; see `ipman_rs.load_body`. Raises ValueError naming the file and what was expected."""
    read, keys = _open(path)
    mean = read("v_template", (-1, 3))
    num_vertices = len(mean)
    if v_template is None:
        v_template = mean
    elif v_template.shape != mean.shape:
        raise ValueError(f"v_template: expected {mean.shape}, as {path} has, got {v_template.shape}")
    parents = _parents(path, read("kintree_table", (2, -1)))
    names = joints.BY_COUNT.get(len(parents))
    if names is None:
        raise ValueError(f"{path}: expected 24 (SMPL), 52 (SMPL+H) or 55 (SMPL-X) joints, found {len(parents)}")
    faces = _faces(path, read("f", (-1, 3)), num_vertices)
    # One layout for all files, and einsum for products: BLAS sums in an order of the layout's.
    regressor = np.array(read("J_regressor", (len(parents), num_vertices)), order="C")
    shapedirs, expressiondirs = _split_shapes(
        read("shapedirs", (num_vertices, 3, -1)), num_betas, has_face=len(names) == len(joints.SMPLX)
    )
    return BodyModel(
        name=path.stem,
        v_template=v_template,
        shapedirs=shapedirs,
        expressiondirs=expressiondirs,
        posedirs=read("posedirs", (num_vertices, 3, 9 * (len(parents) - 1))) if "posedirs" in keys else None,
        J_template=np.einsum("jv,vc->jc", regressor, v_template),
        J_shapedirs=np.einsum("jv,vck->jck", regressor, shapedirs),
        J_expressiondirs=np.einsum("jv,vck->jck", regressor, expressiondirs),
        rest_rotation=np.tile(np.eye(3), (len(parents), 1, 1)),
        weights=read("weights", (num_vertices, len(parents))),
        faces=faces,
        parents=parents,
        joint_names=names,
        hands=_hands(read, flat_hand_mean) if keys.issuperset(HAND_KEYS) else None,
    )


_GENDERS = {"female": "female", "f": "female", "male": "male", "m": "male", "neutral": "neutral", "n": "neutral"}


def gender(word: str) -> str:
    """female, male or neutral, of what files call it; empty for other words."""
    return _GENDERS.get(word.strip().lower().removeprefix("b").strip("'\""), "")


def gender_of(path: Path) -> str:
    """Of a model file: what an array of it says, or its name, or that of its folder, as AMASS's SMPL+H has it; empty
    where nothing does."""
    if path.suffix == ".npz" and "gender" in safe_npz.names(path):
        said = safe_npz.read(path, "gender").reshape(-1)
        if said.dtype.kind in "US" and len(said) == 1:
            return gender(said[0].decode("latin1") if said.dtype.kind == "S" else str(said[0]))
    stem, folder = path.stem.lower(), path.parent.name.lower()
    words = [word for name in (stem, folder) for word in ("female", "male", "neutral") if word in name]
    return next((_GENDERS[word] for word in (*words, *re.split(r"[^a-z]+", stem)) if word in _GENDERS), "")


def _open(path: Path) -> tuple[Read, set[str]]:
    """The names of the file's arrays and a reader that checks them: finite float64 of a shape (-1 fits any size)."""
    if path.suffix == ".npz":
        keys = safe_npz.names(path)

        def raw(key: str, shape: tuple[int, ...]) -> NDArray[Any]:
            return safe_npz.read(path, key)

    elif path.suffix == ".pkl":
        content = safe_pickle.read(path)
        keys = {key for key in content if isinstance(key, str)}

        def raw(key: str, shape: tuple[int, ...]) -> NDArray[Any]:
            return safe_pickle.as_array(content[key], shape)

    else:
        raise ValueError(
            f"{path}: a body model is a .npz or a .pkl file, not {path.suffix or 'a file without suffix'!r}"
        )

    def read(key: str, shape: tuple[int, ...]) -> NDArray[Any]:
        if key not in keys:
            raise ValueError(
                f"{path}: no array {key!r} in it (it has {', '.join(sorted(keys)) or 'none'}); expected a model "
                "file of SMPL, SMPL+H or SMPL-X, not a motion or a mesh"
            )
        try:
            array = raw(key, shape)
        except Exception as error:
            raise ValueError(f"{path}: {key}: {error}") from error
        if array.dtype.kind not in "fiu":
            raise ValueError(f"{path}: {key}: expected numbers, found type {array.dtype}")
        fits = array.ndim == len(shape) and all(want in (-1, got) for want, got in zip(shape, array.shape, strict=True))
        if not fits or array.size == 0:
            wanted = ", ".join("any" if size == -1 else str(size) for size in shape)
            raise ValueError(f"{path}: {key}: expected shape ({wanted}), got {array.shape}")
        if not np.isfinite(array).all():
            raise ValueError(f"{path}: {key}: has NaN or infinite numbers in it")
        return array.astype(float)

    return read, keys


def _parents(path: Path, kintree: NDArray[np.float64]) -> NDArray[np.int64]:
    """Parent of each joint; upstream marks the root with 2**32 - 1 or with -1."""
    parents = np.concatenate([[-1], kintree[0, 1:]])
    if not ((parents[1:] >= 0) & (parents[1:] < np.arange(1, len(parents)))).all():
        raise ValueError(f"{path}: kintree_table: each joint after the root must name an earlier joint as its parent")
    return parents.astype(np.int64)


def _faces(path: Path, faces: NDArray[np.float64], num_vertices: int) -> NDArray[np.int64]:
    if faces.min() < 0 or faces.max() >= num_vertices:
        raise ValueError(
            f"{path}: f: face indices must lie in 0 to {num_vertices - 1}, found {faces.min():.0f} to {faces.max():.0f}"
        )
    return faces.astype(np.int64)


def _split_shapes(
    directions: NDArray[np.float64], num_betas: int, has_face: bool
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Shape and expression directions: one array, expressions after 300 shapes or, in short files, after 10."""
    total = directions.shape[-1]
    start = total
    if has_face:
        start = min(FULL_SHAPE_SPACE if total >= FULL_SHAPE_SPACE + FULL_EXPRESSION_SPACE else 10, total)
    return directions[..., : min(num_betas, start)], directions[..., start : start + EXPRESSIONS]


def _hands(read: Read, flat: bool) -> Hands:
    size = 3 * JOINTS_PER_HAND
    mean = np.concatenate([read("hands_meanl", (size,)), read("hands_meanr", (size,))]).reshape(-1, 3)
    return Hands(
        mean=np.zeros_like(mean) if flat else mean,
        left_components=read("hands_componentsl", (-1, size)),
        right_components=read("hands_componentsr", (-1, size)),
    )
