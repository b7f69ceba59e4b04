"""Work in numbered pieces that are kept on disk, so that a killed run continues with the same bits."""

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
    """A piece is an `.npz` file named by its number. It appears when it is complete, with a hash of its inputs.

    A subclass defines the folder of its pieces (`pieces_folder`) and the inputs that determine their content
    (`manifest`: plain values).
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
        """Whether a piece exists, is complete, and has the same inputs."""
        try:
            return self.file(number).exists() and str(safe_npz.read(self.file(number), "key")) == self.key
        except ValueError:
            return False

    def save(self, number: int, arrays: Mapping[str, Any]) -> None:
        """Writes a piece."""
        with atomic_write(self.file(number)) as out:
            np.savez(out, allow_pickle=False, key=np.str_(self.key), **arrays)

    def result(self, number: int) -> dict[str, NDArray[Any]]:
        """The arrays of a piece. ValueError where it is missing or damaged."""
        names = safe_npz.names(self.file(number)) - {"key"}
        return {name: safe_npz.read(self.file(number), name) for name in sorted(names)}

    def check_folder(self, folder: Path, what: str) -> None:
        """ValueError if the folder holds results (`what` names them) of other inputs."""
        if not (folder / MANIFEST).exists():
            return
        content = read_json(folder / MANIFEST)
        stored = content if isinstance(content, dict) else {}
        names = {**stored, **self.manifest}
        other = [name for name in names if stored.get(name) != self.manifest.get(name)]
        if other:
            raise ValueError(
                f"{folder}: holds {what} ({', '.join(other)} differ); choose another folder with -o, or delete this one"
            )

    def mark_folder(self, folder: Path) -> None:
        """Writes the manifest into the folder of the results."""
        write_whole(folder / MANIFEST, json.dumps(self.manifest, indent=1) + "\n")
