"""Data sets whose sequences lie in files of their own."""

from __future__ import annotations

import os
from collections.abc import Callable, Sequence
from dataclasses import fields
from functools import lru_cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ipman_rs.ground import Ground

from . import check
from .frames import Cameras, Frames, PressureMaps, Rows

KEPT = 4  # sequences that stay in memory: rows are mostly asked for one after the other


class Sequences:
    """Sequences one after the other, each read when one of its frames is asked for.

    `read(i)` gives all the `lengths[i]` frames of sequence i. ValueError, naming `source`, without a frame.
    """

    def __init__(
        self, lengths: Sequence[int], read: Callable[[int], Frames], source: str | os.PathLike[str] = "data set"
    ) -> None:
        self._starts = np.concatenate([[0], np.cumsum(lengths, dtype=np.int64)])
        self._read = lru_cache(KEPT)(read)
        if self._starts[-1] == 0:
            raise ValueError(f"{source}: no frame at all: is the download complete?")

    def __len__(self) -> int:
        return int(self._starts[-1])

    def __getitem__(self, rows: Rows) -> Frames:
        wanted = np.arange(len(self))[rows]
        if not len(wanted):
            return self._read(int(np.diff(self._starts).argmax()))[:0]
        order = np.argsort(wanted, kind="stable")
        parts = [self._rows(int(index), part) for index, part in _runs(self._starts, wanted[order])]
        frames = parts[0] if len(parts) == 1 else join(parts)
        return frames if (order == np.arange(len(order))).all() else frames[np.argsort(order, kind="stable")]

    def _rows(self, index: int, rows: NDArray[np.int64]) -> Frames:
        frames = self._read(index)
        rows = rows - self._starts[index]
        return frames[slice(int(rows[0]), int(rows[-1]) + 1) if (np.diff(rows) == 1).all() else rows]


def _runs(starts: NDArray[np.int64], rows: NDArray[np.int64]) -> list[tuple[np.int64, NDArray[np.int64]]]:
    """The rows, in rising order, by the sequence that they are of."""
    index = np.searchsorted(starts, rows, side="right") - 1
    cuts = np.flatnonzero(np.diff(index)) + 1
    return [(index[start], part) for start, part in zip([0, *cuts], np.split(rows, cuts), strict=True)]


def join(parts: Sequence[Frames]) -> Frames:
    """Frames one after the other. What only some have is NaN in the others; frame rates that differ become None.

    ValueError if they are of different bodies, or have other joints.
    """
    values = {field.name: [getattr(part, field.name) for part in parts] for field in fields(Frames)}
    for name in ("body", "joint_names", "keypoint_names"):
        if any(value != values[name][0] for value in values[name][1:]):
            raise ValueError(f"{name}: expected one for all frames, got {values[name][0]!r} and others")
    counts = [len(part) for part in parts]
    return Frames(**{name: _joined(several, counts) for name, several in values.items()})


def _joined(values: list[Any], counts: list[int]) -> Any:
    given = [value for value in values if value is not None]
    if not given:
        return None
    first = given[0]
    if isinstance(first, np.ndarray):
        return np.concatenate([_like(first, n) if v is None else v for v, n in zip(values, counts, strict=True)])
    if isinstance(first, Ground):
        return _grounds(values, counts)
    if isinstance(first, Cameras):
        return Cameras(*(_column(values, counts, name) for name in ("rotation", "translation", "intrinsics")))
    if isinstance(first, PressureMaps):
        return _maps(values, counts)
    return first if all(value == first for value in values) else None


def _like(array: NDArray[Any], count: int) -> NDArray[Any]:
    """Rows that hold nothing."""
    empty = np.nan if array.dtype.kind == "f" else np.zeros((), array.dtype)[()]
    return np.full((count, *array.shape[1:]), empty, array.dtype)


def _column(values: list[Any], counts: list[int], name: str) -> NDArray[Any]:
    """A field of the values, of which some may be None."""
    return _joined([None if value is None else getattr(value, name) for value in values], counts)


def _maps(values: list[PressureMaps | None], counts: list[int]) -> PressureMaps:
    given = [value for value in values if value is not None]
    if len({(value.values.shape[1:], value.cell) for value in given}) > 1:
        raise ValueError("pressure: expected mats of one size; ask for the frames of one at a time")
    spread = [
        None if value is None else PressureMaps(
            value.values, *(np.broadcast_to(part, (n, 3)) for part in (value.origin, value.e1, value.e2)), value.cell
        )
        for value, n in zip(values, counts, strict=True)
    ]  # fmt: skip
    columns = [_column(spread, counts, name) for name in ("values", "origin", "e1", "e2")]
    return PressureMaps(*columns, given[0].cell)[:]


def _grounds(values: list[Ground | None], counts: list[int]) -> Ground | None:
    if any(value is None for value in values):
        return None
    grounds = [value for value in values if value is not None]
    normals = [np.broadcast_to(ground.normal, (n, 3)) for ground, n in zip(grounds, counts, strict=True)]
    heights = [np.broadcast_to(ground.height, n) for ground, n in zip(grounds, counts, strict=True)]
    first = grounds[0]
    if all(g.height.ndim == 0 and g.height == first.height and (g.normal == first.normal).all() for g in grounds):
        return first
    return Ground(np.concatenate(normals), np.concatenate(heights))


def numbered(name: str, count: int, first: int = 0, step: int = 1) -> NDArray[np.str_]:
    """Names of the frames of a sequence: "name/00000", "name/00001", ..."""
    return np.array([f"{name}/{number:05d}" for number in range(first, first + step * count, step)] or np.empty(0, "U1"))


def judged(name: str, data: Any) -> list[check.Finding]:
    """What can be told from a sample of the frames of `name`, in whose name the findings are."""
    found = check.of_frames(check.sample(data))
    return [check.Finding(each.level, f"{name}: {each.what}", each.advice) for each in found]
