"""Work in numbered pieces that are done once and kept, so that it goes on where it was killed, to the same bits."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ipman_rs.files import atomic_write, read_json, safe_npz, write_whole

MANIFEST = "made_of.json"


class Resumable:
    """A piece is an `.npz` file. It is named by its number, appears when it is whole, and says what it was made of.

    A subclass says where its pieces lie (`pieces_folder`) and what decides their content (`manifest`: plain values).
    """

    @property
    def pieces_folder(self) -> Path:
        raise NotImplementedError

    @property
    def manifest(self) -> dict[str, Any]:
        raise NotImplementedError

    @cached_property
    def key(self) -> str:
        """A hash of `manifest`, which every piece carries."""
        return hashlib.sha256(json.dumps(self.manifest, sort_keys=True).encode()).hexdigest()

    def file(self, number: int) -> Path:
        return self.pieces_folder / f"{number:06d}.npz"

    def done(self, number: int) -> bool:
        """Whether a piece is there, whole, and made of the same."""
        try:
            return self.file(number).exists() and str(safe_npz.read(self.file(number), "key")) == self.key
        except ValueError:
            return False

    def save(self, number: int, arrays: Mapping[str, Any]) -> None:
        with atomic_write(self.file(number)) as out:
            np.savez(out, allow_pickle=False, key=np.str_(self.key), **arrays)

    def result(self, number: int) -> dict[str, NDArray[Any]]:
        """The arrays of a piece. ValueError where it is missing or damaged."""
        names = safe_npz.names(self.file(number)) - {"key"}
        return {name: safe_npz.read(self.file(number), name) for name in sorted(names)}

    def check_folder(self, folder: Path, what: str) -> None:
        """ValueError where the folder holds results that were made of something else; `what`: they are."""
        if not (folder / MANIFEST).exists():
            return
        found = read_json(folder / MANIFEST)
        stored = found if isinstance(found, dict) else {}
        names = {**stored, **self.manifest}
        other = [name for name in names if stored.get(name) != self.manifest.get(name)]
        if other:
            raise ValueError(
                f"{folder}: holds {what} ({', '.join(other)} differ); choose another folder with -o, or delete this one"
            )

    def mark_folder(self, folder: Path) -> None:
        """Writes into the folder what the results in it are made of."""
        write_whole(folder / MANIFEST, json.dumps(self.manifest, indent=1) + "\n")
