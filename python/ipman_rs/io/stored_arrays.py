"""The arrays of an .npz file that holds a body, and what its words say of the model."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

import numpy as np

from ..body import formats
from ..files import safe_npz
from ..files.errors import FileError

_KINDS = ("model", "model_type", "surface_model_type", "body")


class StoredArrays:
    """Arrays of a file by name; nothing in it is executed. `arrays`: what the file holds, where that is in memory;
    `used`: the names of those that were read."""

    def __init__(self, path: Path, arrays: Mapping[str, np.ndarray] | None = None) -> None:
        self.path, self.arrays = path, arrays
        self.names = safe_npz.names(path) if arrays is None else {*arrays}
        self.used: set[str] = set()

    def read(self, name: str) -> np.ndarray:
        return safe_npz.read(self.path, name) if self.arrays is None else self.arrays[name]

    def shape_of(self, name: str) -> tuple[int, ...]:
        return safe_npz.shape_of(self.path, name) if self.arrays is None else self.arrays[name].shape

    def first(self, *names: str) -> np.ndarray | None:
        """The first of these that is there, as numbers."""
        name = self.name(*names)
        if name is None:
            return None
        array = self.read(name)
        if array.dtype.kind not in "fiu":
            raise FileError(self.path, f"{name} holds {array.dtype}, not numbers; save plain numbers")
        self.used.add(name)
        return array

    def name(self, *names: str) -> str | None:
        """The first of these that is there."""
        return next((name for name in names if name in self.names), None)

    def word(self, name: str) -> str:
        """A word, which some files have as bytes; empty where there is none."""
        if name not in self.names:
            return ""
        self.used.add(name)
        return self._word(name)

    def _word(self, name: str) -> str:
        value = self.read(name).reshape(-1)
        if value.dtype.kind not in "US" or len(value) != 1:
            return ""
        return value[0].decode("latin1") if value.dtype.kind == "S" else str(value[0])

    def model(self) -> str:
        """The embedded body that `ipman fit` wrote down, or anny."""
        from ..body import embedded

        named = self._word("model") if "model" in self.names else ""
        return self.word("model") if named in embedded.NAMES else "anny"

    def kind(self) -> str | None:
        """What kind of model the parameters are of, where the file says."""
        for name in (name for name in _KINDS if name in self.names):
            try:
                kind = formats.kind_named(self._word(name))
            except ValueError:  # Python objects
                continue
            if kind is not None:
                self.used.add(name)
                return kind
        return None

    def unused(self) -> tuple[str, ...]:
        return tuple(sorted(self.names - self.used))
