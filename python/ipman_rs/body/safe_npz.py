"""Read chosen arrays of an untrusted `.npz` file: no pickles, no array larger than the bytes that came with it."""

from __future__ import annotations

import zipfile
from pathlib import Path
from typing import Any

import numpy as np
from numpy.lib import format as npy
from numpy.typing import NDArray

MAX_BYTES = 1 << 30  # of one array, unpacked


def names(path: Path) -> set[str]:
    """Names of the arrays in `path`; ValueError if it is no `.npz` file."""
    try:
        with zipfile.ZipFile(path) as archive:
            return {name.removesuffix(".npy") for name in archive.namelist()}
    except (zipfile.BadZipFile, OSError, ValueError) as error:
        raise ValueError(f"{path}: not a .npz file ({error}); is the download complete?") from error


def read(path: Path, name: str) -> NDArray[Any]:
    """Array `name` of `path`; ValueError when it is damaged, holds Python objects, or claims more than it carries."""
    try:
        with zipfile.ZipFile(path) as archive, archive.open(f"{name}.npy") as stream:
            packed = archive.getinfo(f"{name}.npy")
            if packed.file_size > MAX_BYTES:
                raise ValueError(f"unpacks to {packed.file_size} bytes, more than the {MAX_BYTES} that are read")
            reader = npy.read_array_header_1_0 if npy.read_magic(stream)[0] == 1 else npy.read_array_header_2_0
            shape, fortran, dtype = reader(stream)
            if dtype.hasobject:
                raise ValueError("holds Python objects, which are not loaded; save it again as plain numbers")
            count = int(np.prod([int(size) for size in shape], dtype=object))
            data = stream.read(packed.file_size)
            if count * dtype.itemsize != len(data):
                raise ValueError(f"claims shape {shape} of {dtype}, but carries {len(data)} bytes")
            return np.frombuffer(data, dtype).reshape(shape, order="F" if fortran else "C")
    except Exception as error:  # damaged bytes can fail in any way (zlib, struct, header syntax)
        raise ValueError(f"{path}: array {name!r} cannot be read: {error}") from error
