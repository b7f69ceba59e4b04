"""Arrays whose rows are read from disk on demand, so that memory does not grow with their number."""

from __future__ import annotations

import errno
import zipfile
from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ipman_rs.data.frames import Rows
from ipman_rs.files import atomic_write, regular_file, safe_npz

BLOCK = 1 << 16  # rows per block
_CHUNK = 1 << 22  # bytes that are unpacked at once


@dataclass(frozen=True)
class RowsOnDisk:
    """An array (n, ...) in a file, stored row by row from byte `offset` on."""

    path: Path
    offset: int
    dtype: np.dtype[Any]
    shape: tuple[int, ...]
    source: Path | None = None  # the user's file that it was unpacked from

    def __len__(self) -> int:
        return self.shape[0]

    def __getitem__(self, rows: Rows) -> NDArray[Any]:
        """These rows, in this order. OSError if the file has become shorter, ValueError for invalid text."""
        numbers = np.arange(len(self))[rows] if isinstance(rows, slice) else np.asarray(rows)
        values = np.empty((len(numbers), *self.shape[1:]), self.dtype)
        width = self.dtype.itemsize * int(np.prod(self.shape[1:], dtype=int))
        with self.path.open("rb", buffering=0) as file:
            for start, stop in _runs(numbers):
                file.seek(self.offset + int(numbers[start]) * width)
                part = file.read((stop - start) * width)
                if len(part) != (stop - start) * width:
                    raise OSError(f"{self.path}: ends early; was it changed meanwhile?")
                values[start:stop] = np.frombuffer(part, self.dtype).reshape(stop - start, *self.shape[1:])
        try:
            return safe_npz.check_text(values)
        except ValueError as error:
            raise ValueError(f"{self.source or self.path}: {error}") from None

    def blocks(self, size: int = BLOCK) -> Iterator[NDArray[Any]]:
        """All rows, in blocks of `size`."""
        for start in range(0, len(self), size):
            yield self[start : start + size]


def _runs(numbers: NDArray[np.integer]) -> Iterator[tuple[int, int]]:
    """Start and stop of each run of consecutive numbers, which is read at once."""
    if not len(numbers):
        return
    ends = [*(np.flatnonzero(np.diff(numbers) != 1) + 1).tolist(), len(numbers)]
    yield from zip([0, *ends[:-1]], ends, strict=True)


def open_npz(path: Path, name: str, unpacked: Path) -> RowsOnDisk:
    """Array `name` of an .npz file, read in place, or, if it is compressed, unpacked once into a folder.

    Nothing in the file is executed. ValueError if it is damaged, holds Python objects, or is shorter than it claims.
    """
    regular_file(path)
    try:
        with zipfile.ZipFile(path) as archive:
            member = archive.getinfo(f"{name}.npy")
            if member.compress_type == zipfile.ZIP_STORED:
                return _rows(path, safe_npz.locate_array(path, member))
            place = unpacked / f"{name}.npy"
            if not place.exists():
                unpacked.mkdir(parents=True, exist_ok=True)
                with archive.open(member) as stream:
                    _copy(stream, place, member.file_size)
        return replace(open_npy(place), source=path)
    except Exception as error:  # damaged bytes can fail in any way (zlib, struct, header syntax)
        if isinstance(error, OSError) and error.errno not in (None, errno.EINVAL):
            raise  # the disk is full, say, which is no fault of the file
        raise ValueError(f"{path}: array {name!r} cannot be read: {error}") from error


def open_npy(path: Path) -> RowsOnDisk:
    """The array of an `.npy` file. Raises ValueError, without the file's name, where it cannot be read row by row."""
    return _rows(path, safe_npz.locate_array(path))


def _rows(path: Path, place: safe_npz.ArrayLocation) -> RowsOnDisk:
    if place.order == "F" and len(place.shape) > 1:
        raise ValueError("is stored column by column; save np.ascontiguousarray of it")
    return RowsOnDisk(path, place.offset, place.dtype, place.shape)


def _copy(stream: Any, place: Path, size: int) -> None:
    """Copies a stream into a file that appears when it is complete."""
    with atomic_write(place) as file:
        copied = 0
        while chunk := stream.read(_CHUNK):
            copied += len(chunk)
            if copied > size:
                raise ValueError(f"unpacks to more than the {size} bytes that it claims")
            file.write(chunk)
