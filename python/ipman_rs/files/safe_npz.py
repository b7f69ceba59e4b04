"""Read chosen arrays of an untrusted `.npz` file: no pickles, no array larger than the bytes that came with it."""

from __future__ import annotations

import io
import os
import struct
import sys
import zipfile
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import IO, Any, Literal

import numpy as np
from numpy.lib import format as npy
from numpy.typing import NDArray

from ipman_rs.files import read_bytes, regular_file

MAX_BYTES = 1 << 30  # of one array, unpacked
LISTED = 40  # names of arrays in a message


def names(path: Path) -> set[str]:
    """Names of the arrays in `path`; ValueError if it is no `.npz` file."""
    regular_file(path)
    try:
        with zipfile.ZipFile(path) as archive:
            arrays = {name.removesuffix(".npy") for name in archive.namelist()}
        for name in arrays:
            name.encode()  # half a character cannot be written anywhere
        return arrays
    except Exception as error:  # damaged bytes can fail in any way
        raise ValueError(f"{path}: not a .npz file ({error}); is the download complete?") from error


def list_arrays(names: Iterable[str]) -> str:
    """The names of a file's arrays for a message, those of vertices first."""
    ordered = sorted(names, key=lambda name: ("vert" not in name.lower(), name))
    return first_arrays([name[:40] for name in ordered], LISTED) or "nothing"


def first_arrays(names: Sequence[str], most: int) -> str:
    """The first of the arrays' names, and how many there are in all where there are more."""
    return ", ".join(names[:most]) + (f", … ({len(names)} arrays)" if len(names) > most else "")


def read(path: Path, name: str) -> NDArray[Any]:
    """Array `name` of `path`; ValueError when it is damaged, holds Python objects, or claims more than it carries."""
    regular_file(path)
    try:
        with zipfile.ZipFile(path) as archive, archive.open(f"{name}.npy") as stream:
            packed = archive.getinfo(f"{name}.npy")
            if packed.file_size > MAX_BYTES:
                raise ValueError(f"unpacks to {packed.file_size} bytes, more than the {MAX_BYTES} that are read")
            shape, order, dtype = _header(stream)
            data = stream.read(packed.file_size)
            _fits(shape, dtype, len(data))
            return check_text(np.frombuffer(data, dtype).reshape(shape, order=order))
    except Exception as error:  # damaged bytes can fail in any way (zlib, struct, header syntax)
        raise ValueError(f"{path}: array {name!r} cannot be read: {error}") from error


def shape_of(path: Path, name: str) -> tuple[int, ...]:
    """The shape that array `name` of `path` claims; a few bytes are read. Raises as `read`."""
    regular_file(path)
    try:
        with zipfile.ZipFile(path) as archive, archive.open(f"{name}.npy") as stream:
            return tuple(int(size) for size in _header(stream)[0])
    except Exception as error:
        raise ValueError(f"{path}: array {name!r} cannot be read: {error}") from error


def memory_map(path: Path, name: str) -> NDArray[Any]:
    """Array `name` of `path`, mapped into memory: rows are read from disk when they are used.

    numpy.savez stores its arrays as they are, so they can be mapped into memory in place, read-only (and, unlike with
    `read`, without a comparison of checksums). A packed one (numpy.savez_compressed) is read as a whole, once.
    """
    regular_file(path)
    try:
        with zipfile.ZipFile(path) as archive:
            packed = archive.getinfo(f"{name}.npy")
        if packed.compress_type != zipfile.ZIP_STORED:
            return read(path, name)
        place = locate_array(path, packed)
        if 0 in place.shape:
            return np.empty(place.shape, place.dtype)
        return np.memmap(path, place.dtype, "r", place.offset, place.shape, place.order)  # type: ignore[call-overload]
    except Exception as error:
        text = str(error)
        raise ValueError(
            text if text.startswith(f"{path}: ") else f"{path}: array {name!r} cannot be read: {text}"
        ) from error


@dataclass(frozen=True)
class ArrayLocation:
    """The location of an array in a file: from byte `offset` on, row by row ("C") or column by column ("F")."""

    offset: int
    shape: tuple[int, ...]
    order: Literal["C", "F"]
    dtype: np.dtype[Any]


def locate_array(path: Path, member: zipfile.ZipInfo | None = None) -> ArrayLocation:
    """The location of the array of an `.npy` file, or of an uncompressed member of an archive.

    Raises:
        ValueError: it is damaged, holds Python objects, or the file lacks some of the bytes that it claims.
    """
    length = path.stat().st_size
    with path.open("rb") as stream:
        end = length if member is None else _data_offset(stream, member.header_offset) + member.file_size
        shape, order, dtype = _header(stream)
        offset = stream.tell()
    _fits(shape, dtype, min(end, length) - offset)
    return ArrayLocation(offset, tuple(int(size) for size in shape), order, dtype)


def read_npy(path: str | os.PathLike[str]) -> NDArray[Any]:
    """The array of an `.npy` file. ValueError, naming the file, as `read`."""
    data = io.BytesIO(read_bytes(path, MAX_BYTES))
    try:
        shape, order, dtype = _header(data)
        rest = data.read()
        _fits(shape, dtype, len(rest))
        return check_text(np.frombuffer(rest, dtype).reshape(shape, order=order))
    except Exception as error:  # damaged bytes can fail in any way (header syntax, tokens, depth)
        raise ValueError(f"{path}: is no readable .npy file ({error or type(error).__name__})") from error


def check_text(array: NDArray[Any]) -> NDArray[Any]:
    """The array, if its text, where it holds any, is text. numpy and Python do not look before they use it.

    Raises:
        ValueError: it holds characters that Unicode does not have, or halves of characters.
    """
    if array.dtype.kind == "U" and array.size and array.dtype.itemsize:
        codes = np.ascontiguousarray(array).reshape(-1).view(np.dtype(np.uint32).newbyteorder(array.dtype.byteorder))
        if int(codes.max()) > sys.maxunicode or ((codes >= 0xD800) & (codes < 0xE000)).any():
            raise ValueError("holds what is no text (characters that Unicode does not have)")
    return array


def _data_offset(stream: IO[bytes], start: int) -> int:
    """Where the data of the member begin whose local header is at `start`; the stream stands there afterwards."""
    stream.seek(start)
    fields = struct.unpack("<4s22xHH", stream.read(30))
    if fields[0] != b"PK\3\4":
        raise ValueError("no member where the archive's directory says one is")
    return stream.seek(start + 30 + fields[1] + fields[2])


def _header(stream: IO[bytes]) -> tuple[tuple[int, ...], Literal["C", "F"], np.dtype[Any]]:
    """Shape, order and type of a `.npy` array of numbers or text, from its first bytes.

    Raises:
        ValueError: the header is damaged, or claims Python objects or a shape that no array can have.
    """
    reader = npy.read_array_header_1_0 if npy.read_magic(stream)[0] == 1 else npy.read_array_header_2_0
    try:
        shape, fortran, dtype = reader(stream)
    except ValueError as error:
        raise ValueError(str(error)[:160]) from None
    except Exception as error:  # numpy reads it as Python text, which fails in any way
        raise ValueError("its header is damaged; is the download complete?") from error
    if not all(0 <= size < 1 << 63 for size in shape):
        raise ValueError("its header claims a shape that no array can have")
    if dtype.hasobject:
        raise ValueError(
            "holds Python objects, which are not loaded; save plain numbers, and names by np.array(x, str)"
        )
    return shape, "F" if fortran else "C", dtype


def _fits(shape: tuple[int, ...], dtype: np.dtype[Any], size: int) -> None:
    if int(np.prod([int(length) for length in shape], dtype=object)) * dtype.itemsize != size:
        raise ValueError(f"claims shape {shape} of {dtype}, but carries {size} bytes")
