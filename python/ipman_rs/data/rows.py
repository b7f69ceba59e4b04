"""Arrays of an `.npz` file with one row per frame, mapped into memory: only the rows that are used are read.

numpy.savez stores its arrays as they are, so nothing is read before its rows are asked for, in a file of any length. A
file of numpy.savez_compressed has to be unpacked: once, when it is opened, up to 4 GB, which stay in memory.
"""

from __future__ import annotations

import sys
from collections.abc import Iterable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ipman_rs.files import safe_npz

from .check import Finding
from .frames import Rows

TEXT = "text"  # instead of the shape of a row
UNPACKED = 4 << 30  # bytes of packed arrays, together
PIECE = 1 << 14  # rows of a scan that are in memory at once


class RowFile:
    """The arrays of `path` that `shapes` names, each (N, *shape); -1 stands for any size, dimensions of one are free.

    Raises ValueError naming the file and the array for one of `required` that is not there, other shapes or types than
    expected, unequal numbers of rows, and none.
    """

    def __init__(self, path: Path, shapes: Mapping[str, tuple[int, ...] | str], required: Sequence[str]) -> None:
        if not path.is_file():
            raise ValueError(f"{path}: no such file")
        there = safe_npz.names(path)
        lacking = [name for name in required if name not in there]
        if lacking:
            raise ValueError(f"{path}: no {', '.join(lacking)} among its arrays ({', '.join(sorted(there)) or 'none'})")
        self.path, self.shapes = path, shapes
        self.arrays = self._opened(name for name in shapes if name in there)
        first = self.arrays[required[0]]
        self.count = len(first) if first.ndim else 0
        for name, array in self.arrays.items():
            self._check(name, array, required[0])
        if not self.count:
            raise ValueError(f"{path}: no rows: its arrays are empty")

    def __len__(self) -> int:
        return self.count

    def __contains__(self, name: str) -> bool:
        return name in self.arrays

    def __iter__(self) -> Iterator[str]:
        return iter(self.arrays)

    def numbers(self, name: str, rows: Rows) -> NDArray[np.float64]:
        """Rows of an array, in float64."""
        values = np.asarray(self.arrays[name][rows]).astype(np.float64)
        return values.reshape(len(values), *_without_ones(values.shape[1:]))

    def texts(self, name: str, rows: Rows) -> NDArray[np.str_]:
        """Rows of an array of text."""
        values = np.asarray(self.arrays[name][rows]).reshape(-1)
        try:
            texts = values.astype(np.str_)
        except UnicodeDecodeError as error:
            raise ValueError(f"{self.path}: {name}: holds what is no text ({error})") from None
        if texts.nbytes and texts.view(np.uint32).max() > sys.maxunicode:  # numpy and Python do not look
            raise ValueError(f"{self.path}: {name}: holds what is no text (characters that Unicode does not have)")
        return texts

    def scan(self) -> Iterator[Finding]:
        """Findings about NaN and infinity in all arrays of the file."""
        for name, array in self.arrays.items():
            if self.shapes[name] == TEXT:
                continue
            bad = sum(_not_finite(array[start : start + PIECE]) for start in range(0, self.count, PIECE))
            if bad:
                message = f"{name}: NaN or infinity in {bad} of {self.count} rows"
                yield Finding("missing", message, "no figure is computed for them")

    def _opened(self, names: Iterable[str]) -> dict[str, NDArray[Any]]:
        arrays: dict[str, NDArray[Any]] = {}
        unpacked = 0
        for name in names:
            arrays[name] = safe_npz.memory_map(self.path, name)
            unpacked += 0 if isinstance(arrays[name], np.memmap) else arrays[name].nbytes
            if unpacked > UNPACKED:
                advice = "save it again with numpy.savez, which need not be unpacked"
                raise ValueError(f"{self.path}: unpacks to more than {UNPACKED >> 30} GB; {advice}")
        return arrays

    def _check(self, name: str, array: NDArray[Any], first: str) -> None:
        wanted = self.shapes[name]
        text = isinstance(wanted, str)
        shape: tuple[int, ...] = () if isinstance(wanted, str) else wanted
        got = _without_ones(array.shape[1:])
        fits = len(got) == len(shape) and all(size in (-1, own) for size, own in zip(shape, got, strict=True))
        if array.ndim == 0 or not fits:
            sizes = ", ".join(["N", *("any" if size == -1 else str(size) for size in shape)])
            raise ValueError(f"{self.path}: {name}: expected shape ({sizes}), got {array.shape}")
        if len(array) != self.count:
            raise ValueError(f"{self.path}: {name}: expected {self.count} rows, as {first} has, got {len(array)}")
        if array.dtype.kind not in ("US" if text else "fiub"):
            raise ValueError(f"{self.path}: {name}: expected {'text' if text else 'numbers'}, got type {array.dtype}")


def _without_ones(shape: tuple[int, ...]) -> tuple[int, ...]:
    return tuple(size for size in shape if size != 1)


def _not_finite(values: NDArray[Any]) -> int:
    return int((~np.isfinite(values.reshape(len(values), -1)).all(axis=1)).sum())
