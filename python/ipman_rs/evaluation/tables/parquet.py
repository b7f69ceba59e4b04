"""Reading predictions from Parquet files with pyarrow (the extra `evaluate`): columns are unpacked into .npy files."""

from __future__ import annotations

import errno
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np
from numpy.lib import format as npy
from numpy.typing import NDArray

from ipman_rs.files import atomic_write

from .layout import FOR_ALL, NUMBERS, TEXT
from .rows import RowsOnDisk, open_npy

_BATCH = 4096  # rows


def require_pyarrow() -> tuple[Any, Any]:
    """pyarrow and its Parquet module; ValueError where it is missing."""
    try:
        import pyarrow
        import pyarrow.compute
        import pyarrow.parquet
    except ImportError as error:
        raise ValueError("Parquet needs pyarrow: pip install 'ipman_rs[evaluate]'") from error
    return pyarrow, pyarrow.parquet


def read(path: Path, unpacked: Path) -> tuple[dict[str, RowsOnDisk], dict[str, Any], frozenset[str]]:
    """The columns of predictions, unpacked into a folder; the values that all frames share; the names of all columns.

    Raises:
        ValueError: the file is damaged, or pyarrow is missing.
    """
    require_pyarrow()
    try:
        with _open(path) as file:
            available = frozenset(file.schema_arrow.names)
            columns = {name: _unpack(path, file, name, unpacked) for name in (*TEXT, *NUMBERS) if name in available}
            common = {
                name: _common_value(path, file, name)
                for name in FOR_ALL
                if name in available and file.metadata.num_rows
            }
    except Exception as error:  # damaged bytes can fail in any way
        if isinstance(error, OSError) and error.errno not in (None, errno.EINVAL):
            raise  # the disk is full, say
        if str(error).startswith(f"{path}: "):
            raise
        raise ValueError(f"{path}: not a Parquet file that can be read ({error}); is it complete?") from error
    return columns, common, available


@contextmanager
def _open(path: Path) -> Iterator[Any]:
    _, parquet = require_pyarrow()
    # Buffered: otherwise a whole row group, often the whole file, comes into memory.
    with parquet.ParquetFile(path, buffer_size=1 << 20, pre_buffer=False) as file:
        yield file


def _unpack(path: Path, file: Any, name: str, folder: Path) -> RowsOnDisk:
    place = folder / f"{name}.npy"
    if not place.exists():
        folder.mkdir(parents=True, exist_ok=True)
        shape, dtype = _shape(path, file, name)
        with atomic_write(place) as out:
            npy.write_array_header_1_0(out, {"descr": dtype.str, "fortran_order": False, "shape": shape})
            for rows in _batches(path, file, name):
                if rows.shape[1:] != shape[1:]:
                    raise ValueError(f"{path}: {name}: rows of {rows.shape[1:]} and of {shape[1:]} numbers")
                out.write(np.ascontiguousarray(rows, dtype).tobytes())
    return open_npy(place)


def _shape(path: Path, file: Any, name: str) -> tuple[tuple[int, ...], np.dtype[Any]]:
    """Shape and type of a whole column; text is as wide as its longest entry."""
    row: tuple[int, ...] = ()
    dtype = np.dtype("U1")
    for number, rows in enumerate(_batches(path, file, name)):
        dtype = np.promote_types(dtype, rows.dtype) if number and rows.dtype.kind == "U" else rows.dtype
        row = row if number else rows.shape[1:]
        if rows.dtype.kind != "U":
            break
    return (file.metadata.num_rows, *row), dtype


def _batches(path: Path, file: Any, name: str) -> Iterator[NDArray[Any]]:
    """The rows of a column, batch by batch, (n,) or (n, width)."""
    pyarrow, _ = require_pyarrow()
    for batch in file.iter_batches(batch_size=_BATCH, columns=[name]):
        column = batch.column(0)
        count = len(column)
        nested = False
        while hasattr(column.type, "value_type") and not pyarrow.types.is_dictionary(column.type):
            if column.null_count:
                raise ValueError(f"{path}: {name}: a row is missing (null)")
            lengths = pyarrow.compute.list_value_length(column).unique()
            if len(lengths) > 1:
                raise ValueError(f"{path}: {name}: rows of different lengths: {lengths.to_pylist()[:4]}")
            column, nested = column.flatten(), True
        if column.null_count:
            raise ValueError(f"{path}: {name}: a value is missing (null)")
        values = np.asarray(column.to_pylist(), str) if _is_text(column.type) else column.to_numpy(zero_copy_only=False)
        yield values.reshape(count, -1) if nested and count else values


def _is_text(kind: Any) -> bool:
    types = require_pyarrow()[0].types
    return types.is_string(kind) or types.is_large_string(kind) or types.is_dictionary(kind)


def _common_value(path: Path, file: Any, name: str) -> NDArray[Any]:
    """The value that all rows have. ValueError where they differ."""
    first = None
    for rows in _batches(path, file, name):
        first = rows[0] if first is None else first
        if (rows != first).any():
            raise ValueError(f"{path}: {name}: expected one for all frames, got {first!r} and others")
    return np.asarray(first)
