"""The arrays of a body model's file, `.npz` or `.pkl`; nothing in it is executed."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..files import safe_npz, safe_pickle

Read = Callable[[str, tuple[int, ...]], NDArray[Any]]


class ModelFile:
    """`keys`: the names of the file's arrays. `expected`: the kinds of files that can be read, for errors."""

    def __init__(self, path: Path, keys: set[str], raw: Read, expected: str) -> None:
        self.path, self.keys, self._raw, self._expected = path, keys, raw, expected

    @classmethod
    def open(cls, path: Path, expected: str) -> ModelFile:
        """Raises ValueError, naming the file, for one that is damaged, hostile, or of another kind."""
        if path.suffix == ".npz":
            return cls(path, safe_npz.names(path), lambda key, _: safe_npz.read(path, key), expected)
        if path.suffix == ".pkl":
            content = safe_pickle.read(path)
            keys = {key for key in content if isinstance(key, str)}
            return cls(path, keys, lambda key, shape: safe_pickle.as_array(content[key], shape), expected)
        raise ValueError(
            f"{path}: a body model is a .npz or a .pkl file, not {path.suffix or 'a file without suffix'!r}"
        )

    def read(self, key: str, shape: tuple[int, ...]) -> NDArray[np.float64]:
        """An array of finite numbers of this shape, in which -1 fits any size. ValueError for another one, or none."""
        if key not in self.keys:
            raise ValueError(
                f"{self.path}: no array {key!r} in it (it has {', '.join(sorted(self.keys)) or 'none'}); expected a "
                f"model file of {self._expected}, not a motion or a mesh"
            )
        try:
            array = self._raw(key, shape)
        except Exception as error:
            raise ValueError(f"{self.path}: {key}: {error}") from error
        if array.dtype.kind not in "fiu":
            raise ValueError(f"{self.path}: {key}: expected numbers, found type {array.dtype}")
        fits = array.ndim == len(shape) and all(want in (-1, got) for want, got in zip(shape, array.shape, strict=True))
        if not fits or array.size == 0:
            wanted = ", ".join("any" if size == -1 else str(size) for size in shape)
            raise ValueError(f"{self.path}: {key}: expected shape ({wanted}), got {array.shape}")
        if not np.isfinite(array).all():
            raise ValueError(f"{self.path}: {key}: has NaN or infinite numbers in it")
        return array.astype(float)

    def faces(self, key: str, num_vertices: int) -> NDArray[np.int64]:
        """Faces (F, 3) of a mesh with so many vertices. ValueError for others."""
        faces = self.read(key, (-1, 3))
        if faces.min() < 0 or faces.max() >= num_vertices:
            raise ValueError(
                f"{self.path}: {key}: face indices must lie in 0 to {num_vertices - 1}, found {faces.min():.0f} to "
                f"{faces.max():.0f}"
            )
        return faces.astype(np.int64)
