"""Read the arrays of a pickled body model, or of a data set's file, without executing anything from the file.

SMPL files are pickles of Python 2 dictionaries that hold numpy arrays, chumpy arrays and scipy sparse matrices. A
pickle is a program, so this one runs on a short allow-list: every global it may name becomes an inert record of ours,
and no array is made before its claimed shape has been compared with the bytes that came with it. The interpreter is
the standard library's pure Python one: the C one allocates whatever a length field or a memo index claims (a 67-byte
file can ask for 2 GB).
"""

from __future__ import annotations

import io
import math
import pickle
import re
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ipman_rs.files import regular_file

from .safe_npz import check_text

BODY_MODEL, BODY_MODELS = "body model", "an unmodified SMPL, SMPL+H or SMPL-X file"
MAX_BYTES = 1 << 30  # the largest upstream file (SMPL-X with 400 components, in float64) has about half of that


class Record:
    """What an object in the file becomes: its state, nothing that runs."""

    args: tuple[Any, ...] = ()
    state: Any = None

    def __init__(self, *args: Any):
        self.args = args

    def __setstate__(self, state: Any) -> None:
        self.state = state


class DtypeRecord(Record):
    def resolve(self) -> np.dtype:
        code = self.args[0] if self.args else None
        if not isinstance(code, str) or not re.fullmatch(r"[<>|=]?([biuf][1248]|O8?|[SU]\d{1,4})", code):
            raise ValueError(f"array of unsupported type {code!r}")
        order = self.state[1] if self.state else "="
        return np.dtype(code).newbyteorder(order if order in "<>" else "=")


class ArrayRecord(Record):
    """`numpy.ndarray`: state = (version, shape, dtype, Fortran order, bytes)."""

    def resolve(self) -> NDArray[Any]:
        if not isinstance(self.state, tuple) or len(self.state) < 4 or not isinstance(self.state[-3], DtypeRecord):
            raise ValueError("array without its contents")
        shape, dtype, fortran, data = self.state[-4:]
        return _array(data, dtype.resolve(), shape, "F" if fortran else "C")


class ChumpyRecord(Record):
    """`chumpy.ch.Ch`: the array is under "x"."""

    def resolve(self) -> NDArray[Any]:
        return _resolve(self.state["x"], ArrayRecord)


class SelectRecord(Record):
    """`chumpy.reordering.Select`, a slice of another chumpy array: elements `idxs` of "a", in `preferred_shape`."""

    def resolve(self) -> NDArray[Any]:
        source = _resolve(self.state["a"], (ChumpyRecord, ArrayRecord))
        chosen = source.ravel()[_resolve(self.state["idxs"], ArrayRecord)]
        return chosen.reshape(self.state["preferred_shape"])


class SparseRecord(Record):
    """`scipy.sparse` matrix, compressed by column or by row. Its shape is a claim: compare before `dense`."""

    by_column = True

    @property
    def shape(self) -> tuple[int, ...]:
        return tuple(int(size) for size in self.state["_shape" if "_shape" in self.state else "shape"])

    def dense(self) -> NDArray[Any]:
        data, indices, starts = (_resolve(self.state[key], ArrayRecord) for key in ("data", "indices", "indptr"))
        lines, length = self.shape[::-1] if self.by_column else self.shape
        counts = np.diff(starts.astype(np.int64))
        if len(starts) != lines + 1 or (counts < 0).any() or counts.sum() != len(data) or len(data) != len(indices):
            raise ValueError("sparse matrix whose index arrays do not fit together")
        dense = np.zeros((lines, length), data.dtype)
        np.add.at(dense, (np.repeat(np.arange(lines), counts), indices), data)
        return dense.T if self.by_column else dense


class SparseRowsRecord(SparseRecord):
    by_column = False


class ScalarRecord(Record):
    """`numpy.core.multiarray.scalar`: args = (dtype, bytes)."""

    def resolve(self) -> NDArray[Any]:
        dtype, data = self.args
        if not isinstance(dtype, DtypeRecord):
            raise ValueError("number without its type")
        return _array(data, dtype.resolve(), (), "C")


class InertObject(Record):
    """Stands for a class that the file may name (`numpy.ndarray`, `object`), and for a set, without its contents."""


class ForeignObject(Record):
    """Stands for an object of another program's class, such as its settings; its contents are dropped."""

    def append(self, _: Any) -> None: ...

    def extend(self, _: Any) -> None: ...


def _array(data: Any, dtype: np.dtype, shape: Any, order: str) -> NDArray[Any]:
    """The array if its claimed shape is what the data fill exactly."""
    if not isinstance(shape, tuple) or not all(isinstance(size, int) and size >= 0 for size in shape):
        raise ValueError(f"array with the impossible shape {shape!r:.80}")
    if dtype.hasobject:
        raise ValueError("array of Python objects where numbers are expected")
    if isinstance(data, str):
        data = data.encode("latin1")  # how Python 2 wrote bytes
    if math.prod(shape) * dtype.itemsize != len(data):
        raise ValueError(f"array claims shape {str(shape):.80} of {dtype}, but {len(data)} bytes came with it")
    return np.frombuffer(data, dtype).reshape(shape, order=order)  # type: ignore[call-overload]


def _resolve(value: Any, kinds: type[Record] | tuple[type[Record], ...]) -> NDArray[Any]:
    if not isinstance(value, kinds):
        raise ValueError(f"expected an array inside a chumpy or scipy object, found {type(value).__name__}")
    return value.resolve()  # type: ignore[attr-defined]


def _reconstruct(*_: Any) -> ArrayRecord:
    """numpy's empty array, to be filled by the state that follows; its arguments are of no use."""
    return ArrayRecord()


def _from_buffer(data: Any, dtype: DtypeRecord, shape: Any, order: Any) -> ArrayRecord:
    """numpy's pickle protocol 5."""
    record = ArrayRecord()
    record.state = (shape, dtype, order == "F", data)
    return record


def _new_object(kind: type[Record], *_: Any) -> Record:
    """copyreg._reconstructor: how protocols 0 and 1 make an object."""
    if not (isinstance(kind, type) and issubclass(kind, Record)):
        raise pickle.UnpicklingError("tries to build something that is not an array")
    return kind()


def _encode(text: Any, encoding: Any = "latin1") -> bytes:
    """_codecs.encode: how Python 3 writes bytes in protocol 2."""
    if not isinstance(text, str) or encoding != "latin1":
        raise pickle.UnpicklingError("tries to encode something other than bytes")
    return text.encode("latin1")


def _no_bytes() -> bytes:
    """bytes(): how protocol 2 writes an empty array's contents. It takes no size."""
    return b""


def _allowed() -> dict[tuple[str, str], Callable[..., Any]]:
    table: dict[tuple[str, str], Callable[..., Any]] = {
        ("numpy", "ndarray"): InertObject,
        ("numpy", "dtype"): DtypeRecord,
        ("_codecs", "encode"): _encode,
        ("chumpy", "Ch"): ChumpyRecord,
        ("chumpy.ch", "Ch"): ChumpyRecord,
        ("chumpy.reordering", "Select"): SelectRecord,
    }
    for core in ("numpy.core", "numpy._core"):  # numpy 1 and 2
        table[f"{core}.multiarray", "_reconstruct"] = _reconstruct
        table[f"{core}.multiarray", "scalar"] = ScalarRecord
        table[f"{core}.numeric", "_frombuffer"] = _from_buffer
    for builtins, copyreg in (("__builtin__", "copy_reg"), ("builtins", "copyreg")):  # Python 2 and 3
        table[builtins, "object"] = InertObject
        table[builtins, "set"] = InertObject
        table[builtins, "bytes"] = _no_bytes
        table[copyreg, "_reconstructor"] = _new_object
    for form, record in (("csc", SparseRecord), ("csr", SparseRowsRecord)):
        for module in (f"scipy.sparse.{form}", f"scipy.sparse._{form}"):
            table[module, f"{form}_matrix"] = record
            table[module, f"{form}_array"] = record
    return table


ALLOWED = _allowed()
# What other programs' settings are made of; another name of the standard library means that a file wants to do things.
HARMLESS = ("collections", "datetime", "enum", "pathlib", "typing", "copy_reg", "copyreg", "uuid")
HARMLESS_TYPES = ("bool", "bytes", "complex", "dict", "float", "frozenset", "int", "list", "long", "object", "range",
                  "set", "slice", "str", "tuple", "type", "unicode")  # fmt: skip
FORBIDDEN_OPCODES = (
    pickle.EXT1, pickle.EXT2, pickle.EXT4, pickle.PERSID, pickle.BINPERSID, pickle.NEXT_BUFFER, pickle.READONLY_BUFFER,
    pickle.ADDITEMS, pickle.FROZENSET, pickle.NEWOBJ_EX, pickle.INST, pickle.OBJ,
)  # fmt: skip


_Interpreter: Any = pickle._Unpickler  # type: ignore[attr-defined]  # the pure Python one; typeshed does not know it


class RestrictedUnpickler(_Interpreter):
    """The standard library's interpreter with the allow-list and without the opcodes that no body model uses."""

    dispatch: dict[int, Any] = {
        code: run for code, run in _Interpreter.dispatch.items() if bytes([code]) not in FORBIDDEN_OPCODES
    }

    def __init__(self, stream: io.BytesIO, what: str) -> None:
        super().__init__(stream, encoding="latin1")
        self.what = what

    def find_class(self, module: str, name: str) -> Callable[..., Any]:
        if (module, name) not in ALLOWED:
            raise pickle.UnpicklingError(f"names {module}.{name}, which no {self.what} needs; it is refused")
        return ALLOWED[module, name]

    def load_build(self) -> None:
        """State goes to records only, never to a function or a class."""
        state = self.stack.pop()
        record = self.stack[-1]
        if not isinstance(record, Record):
            raise pickle.UnpicklingError(f"tries to set the state of a {type(record).__name__}")
        record.__setstate__(state)

    def load_setitem(self) -> None:
        value, key = self.stack.pop(), self.stack.pop()
        self._fill([key, value])

    def load_setitems(self) -> None:
        self._fill(self.pop_mark())

    def _fill(self, items: list[Any]) -> None:
        """Keys are plain: hashing a tuple nested a million deep would overflow the stack."""
        target = self.stack[-1]
        if isinstance(target, ForeignObject):
            return
        if not isinstance(target, dict) or not all(isinstance(key, (str, bytes, int, float)) for key in items[::2]):
            raise pickle.UnpicklingError("has a dictionary key that is neither text nor a number")
        target.update(zip(items[::2], items[1::2], strict=True))

    def load_bytearray8(self) -> None:
        self.append(self.read(int.from_bytes(self.read(8), "little")))

    dispatch[pickle.BUILD[0]] = load_build
    dispatch[pickle.SETITEM[0]] = load_setitem
    dispatch[pickle.SETITEMS[0]] = load_setitems
    dispatch[pickle.BYTEARRAY8[0]] = load_bytearray8


class TolerantUnpickler(RestrictedUnpickler):
    """Classes of other programs become inert objects; the standard library's functions stay refused."""

    def find_class(self, module: str, name: str) -> Callable[..., Any]:
        if (module, name) in ALLOWED:
            return ALLOWED[module, name]
        if module in ("builtins", "__builtin__"):
            harmless = name in HARMLESS_TYPES
        else:
            first = module.partition(".")[0]
            harmless = first in HARMLESS or first not in sys.stdlib_module_names
        return ForeignObject if harmless else super().find_class(module, name)

    def load_additems(self) -> None:
        """A set's contents are dropped: nobody needs them, and hashing runs what they say."""
        self.pop_mark()

    def load_frozenset(self) -> None:
        self.pop_mark()
        self.append(ForeignObject())

    dispatch = RestrictedUnpickler.dispatch | {
        pickle.ADDITEMS[0]: load_additems,
        pickle.FROZENSET[0]: load_frozenset,
        pickle.NEWOBJ_EX[0]: _Interpreter.load_newobj_ex,
    }


def read(path: Path, what: str = BODY_MODEL, expected: str = BODY_MODELS, tolerant: bool = False) -> dict[str, Any]:
    """The pickled dictionary in `path`: numbers and text as they are, arrays as records for `as_array`.

    `what` and `expected` name the file in messages. `tolerant`: objects of other programs' classes are passed over,
    such as settings beside the arrays. Raises ValueError when the file is missing, too large, truncated, damaged, not a
    dictionary, or names anything not allowed.
    """
    try:
        size = regular_file(path).stat().st_size
        if size > MAX_BYTES:
            raise ValueError(f"{path}: {size} bytes is more than any {what} has ({MAX_BYTES}); is it the right file?")
        data = path.read_bytes()
    except OSError as error:
        raise ValueError(f"{path}: cannot be read: {error.strerror or error}") from error
    try:
        interpreter = TolerantUnpickler if tolerant else RestrictedUnpickler
        content = interpreter(io.BytesIO(data), what).load()
    except Exception as error:  # damaged bytes can fail in any way
        reason = (
            f"the pickle {error}" if isinstance(error, pickle.UnpicklingError) else f"{type(error).__name__}: {error}"
        )
        raise ValueError(
            f"{path}: cannot be read as a pickled {what}: {reason}. Expected {expected}; download it again, or save "
            "its arrays with numpy.savez and load that"
        ) from error
    if not isinstance(content, dict):
        raise ValueError(f"{path}: expected a pickled dictionary of arrays, found a {type(content).__name__}")
    return content


def as_array(value: Any, shape: tuple[int, ...] | None = None) -> NDArray[Any]:
    """The array behind a value of `read`; a sparse matrix only if it has the expected `shape`."""
    try:
        if isinstance(value, SparseRecord):
            if value.shape != shape:
                raise ValueError(f"expected shape {shape}, got a sparse matrix of shape {value.shape}")
            return value.dense()
        return check_text(_resolve(value, (ArrayRecord, ChumpyRecord, ScalarRecord, SelectRecord)))
    except (ArithmeticError, AttributeError, LookupError, TypeError) as error:  # state of another kind than expected
        raise ValueError(f"is no array that can be read: {type(error).__name__}: {error}") from None
