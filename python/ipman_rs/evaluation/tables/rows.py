"""Arrays whose rows stay on disk until they are asked for: memory does not grow with their number."""

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

BLOCK = 1 << 16  # rows that are gone through at a time
_CHUNK = 1 << 22  # bytes that are unpacked at a time


@dataclass(frozen=True)
class RowsOnDisk:
    """An array (n, ...) that lies in a file from a byte on, row after row."""

    path: Path
    offset: int
    dtype: np.dtype[Any]
    shape: tuple[int, ...]
    source: Path | None = None  # the file of the user's that it was unpacked from

    def __len__(self) -> int:
        return self.shape[0]

    def __getitem__(self, rows: Rows) -> NDArray[Any]:
        """Those rows, in this order. OSError where the file has become shorter, ValueError where text is none."""
        numbers = np.arange(len(self))[rows] if isinstance(rows, slice) else np.asarray(rows)
        found = np.empty((len(numbers), *self.shape[1:]), self.dtype)
        width = self.dtype.itemsize * int(np.prod(self.shape[1:], dtype=int))
        with self.path.open("rb", buffering=0) as file:
            for start, stop in _runs(numbers):
                file.seek(self.offset + int(numbers[start]) * width)
                part = file.read((stop - start) * width)
                if len(part) != (stop - start) * width:
                    raise OSError(f"{self.path}: ends early; was it changed meanwhile?")
                found[start:stop] = np.frombuffer(part, self.dtype).reshape(stop - start, *self.shape[1:])
        try:
            return safe_npz.check_text(found)
        except ValueError as error:
            raise ValueError(f"{self.source or self.path}: {error}") from None

    def blocks(self, size: int = BLOCK) -> Iterator[NDArray[Any]]:
        """All rows, `size` after the other."""
        for start in range(0, len(self), size):
            yield self[start : start + size]


def _runs(numbers: NDArray[np.integer]) -> Iterator[tuple[int, int]]:
    """Stretches of numbers that follow each other, which are read at once."""
    if not len(numbers):
        return
    ends = [*(np.flatnonzero(np.diff(numbers) != 1) + 1).tolist(), len(numbers)]
    yield from zip([0, *ends[:-1]], ends, strict=True)


def open_npz(path: Path, name: str, unpacked: Path) -> RowsOnDisk:
    """Array `name` of an .npz file: where it lies in there, or, if it is compressed, unpacked once into a folder.

    Nothing is executed. ValueError if it is damaged, holds Python objects, or lacks some of the bytes that it claims.
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
    """The bytes of a stream into a file that appears once it is whole."""
    with atomic_write(place) as file:
        copied = 0
        while chunk := stream.read(_CHUNK):
            copied += len(chunk)
            if copied > size:
                raise ValueError(f"unpacks to more than the {size} bytes that it claims")
            file.write(chunk)
