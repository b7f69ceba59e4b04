"""The template: everything about a body's surface that is computed once for all its poses."""

from __future__ import annotations

import itertools
import weakref
from collections.abc import Sequence
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ipman_rs import _core
from ipman_rs.checks import real_array, whole
from ipman_rs.units import warn_odd_size

if TYPE_CHECKING:
    from scipy.sparse import csr_array

_KEYS = itertools.count()
_BY_KEY: weakref.WeakValueDictionary[int, BodyTemplate] = weakref.WeakValueDictionary()


class BodyTemplate:
    """A body's surface, its parts and its samples.

    The faces must form a consistently oriented surface that faces outwards. Open edges (SMPL-X's mouth) are allowed:
    they are closed by a fan to the mean of their loop, and `watertight` is False.

    Args:
        vertices: (V, 3) metres, a typical pose; the samples are spread evenly over this one.
        faces: (F, 3) indices into the vertices, counter-clockwise seen from outside.
        face_parts: (F,) the part of each face, 0 to P − 1 without gaps; None for one part.
        part_names: P names; numbered by default.
        num_samples: the paper's N_U.
        seed: of the samples; the same seed gives the same samples on every machine.

    Raises:
        ValueError: a shape, an index, a label or the surface is wrong; the message says where.
        TypeError: masked arrays, or numbers of the wrong kind.

    Warns:
        UnitsWarning: the body is too large or too small for metres.
    """

    def __init__(
        self,
        vertices: ArrayLike,
        faces: ArrayLike,
        face_parts: ArrayLike | None = None,
        part_names: Sequence[str] | None = None,
        num_samples: int = 20_000,
        seed: int = 0,
    ) -> None:
        self.vertices = np.array(_table("vertices", vertices, columns=3), dtype=np.float64, order="C")
        self.faces = _indices("faces", _table("faces", faces, columns=3))
        labels = np.zeros(len(self.faces), np.int64) if face_parts is None else real_array("face_parts", face_parts)
        if labels.ndim != 1 or len(labels) != len(self.faces):
            raise ValueError(f"face_parts: expected ({len(self.faces)},), one label a face, got {labels.shape}")
        self.face_parts = _indices("face_parts", labels)
        samples = whole("num_samples", num_samples, 1, 10_000_000)
        self._seed = whole("seed", seed, 0, 2**64 - 1)
        self._core = _core.Template(self.vertices, self.faces, self.face_parts, samples, self._seed)
        self._collisions: dict[float, _core.Collision] = {}
        self._quantities: dict[tuple[Any, ...], _core.Quantity] = {}  # the latest: see `Quantity.of`
        self.part_names = _names(part_names, self.num_parts)
        for array in (self.vertices, self.faces, self.face_parts):
            array.setflags(write=False)
        with np.errstate(over="ignore"):
            size = np.ptp(self.vertices, axis=0).max()
        warn_odd_size(size, "the template")
        self._key = next(_KEYS)
        _BY_KEY[self._key] = self

    @property
    def num_vertices(self) -> int:
        return self._core.num_vertices

    @property
    def num_faces(self) -> int:
        return len(self.faces)

    @property
    def num_parts(self) -> int:
        return self._core.num_parts

    @property
    def num_samples(self) -> int:
        return self._core.num_samples

    @property
    def watertight(self) -> bool:
        """Every edge has a face on both sides."""
        return self._core.watertight

    @cached_property
    def sample_faces(self) -> NDArray[np.int64]:
        """(S,) the face of each sample, ascending."""
        return self._core.sample_faces

    @cached_property
    def sample_barycentric(self) -> NDArray[np.float64]:
        """(S, 3) the weights of each sample on its face's vertices."""
        return self._core.sample_barycentric

    @cached_property
    def sample_parts(self) -> NDArray[np.int64]:
        """(S,) the part of each sample: its face's."""
        return self._core.sample_parts

    def regressor(self) -> csr_array:
        """W, (S, V) sparse with three weights a row: `regressor() @ vertices` are the samples of one body."""
        from scipy.sparse import csr_array

        columns = self.faces[self.sample_faces].ravel()
        rows = np.arange(0, 3 * self.num_samples + 1, 3)
        weights = self.sample_barycentric.flatten()  # a copy: scipy sorts in place
        return csr_array((weights, columns, rows), shape=(self.num_samples, self.num_vertices))

    def __repr__(self) -> str:
        return (
            f"BodyTemplate({self.num_vertices} vertices, {self.num_faces} faces, {self.num_parts} parts, "
            f"{self.num_samples} samples{'' if self.watertight else ', open'})"
        )

    def __reduce__(self) -> tuple[Any, ...]:
        return BodyTemplate, (
            self.vertices, self.faces, self.face_parts, self.part_names, self.num_samples, self._seed,
        )  # fmt: skip


def by_key(key: int) -> BodyTemplate:
    """The living template with this `_key`: torch operators carry numbers, not objects."""
    try:
        return _BY_KEY[key]
    except KeyError:
        raise ValueError(f"template: number {key} does not live in this process (any more)") from None


def _table(name: str, value: ArrayLike, columns: int) -> NDArray[Any]:
    array = real_array(name, value)
    if array.ndim != 2 or array.shape[1] != columns:
        raise ValueError(f"{name}: expected (n, {columns}), got {array.shape}")
    return array


def _indices(name: str, array: NDArray[Any]) -> NDArray[np.int64]:
    if array.dtype.kind == "f":
        raise TypeError(f"{name}: expected integers, got dtype {array.dtype}")
    if array.dtype == np.uint64 and array.size and array.max() > np.iinfo(np.int64).max:
        raise ValueError(f"{name}: {array.max()} is no index")
    return np.array(array, dtype=np.int64, order="C")


def _names(names: Sequence[str] | None, num_parts: int) -> tuple[str, ...]:
    if names is None:
        return ("body",) if num_parts == 1 else tuple(f"part_{part}" for part in range(num_parts))
    if isinstance(names, np.ndarray):
        names = names.tolist()
    if isinstance(names, str) or not isinstance(names, Sequence):
        raise TypeError(f"part_names: expected a list of {num_parts} names, got {names!r}")
    if len(names) != num_parts:
        raise ValueError(f"part_names: expected {num_parts} names, got {names!r}")
    return tuple(str(name) for name in names)
