"""A sequence of posed bodies whose vertices are computed on demand, a piece at a time."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .model import BodyModel

Index = slice | NDArray[np.integer]


@dataclass(frozen=True, eq=False)
class PosedSequence:
    """T bodies of one model in their poses; reads like an array (T, V, 3) that is indexed along its first axis.

    `parameters(index)` gives pose (n, J, 3), betas, transl and, where they have one, expression of the bodies that a
    slice or an array of n numbers names, as `BodyModel.forward` takes them.
    """

    body: BodyModel
    length: int
    parameters: Callable[[Index], tuple[Any, ...]]

    @classmethod
    def of(
        cls, body: BodyModel, pose: ArrayLike, betas: ArrayLike | None = None, transl: ArrayLike | None = None
    ) -> PosedSequence:
        """Bodies of the poses (T, J, 3) or (T, J, 6); betas and transl (B,) or T rows. Raises ValueError."""
        poses = np.asarray(pose)
        if poses.ndim != 3:
            raise ValueError(f"pose: expected (T, {body.num_joints}, 3), got shape {poses.shape}")
        columns = []
        for name, value in (("betas", betas), ("transl", transl)):
            column = None if value is None else np.asarray(value)
            if column is not None and column.shape[:-1] not in ((), (1,), (len(poses),)):
                raise ValueError(f"{name}: expected one row or {len(poses)}, got shape {column.shape}")
            columns.append(column if column is None else column.reshape(-1, column.shape[-1]))

        def parameters(index: Index) -> tuple[NDArray[Any], NDArray[Any] | None, NDArray[Any] | None]:
            chosen = [None if column is None else rows_of(column, index) for column in columns]
            return poses[index], chosen[0], chosen[1]

        return cls(body, len(poses), parameters)

    def __len__(self) -> int:
        return self.length

    @property
    def shape(self) -> tuple[int, int, int]:
        return self.length, self.body.num_vertices, 3

    @property
    def ndim(self) -> int:
        return 3

    def __getitem__(self, index: int | np.integer | Index) -> NDArray[np.floating]:
        if isinstance(index, (int, np.integer)):
            return self[np.array([range(self.length)[index]])][0]
        return self.body(*self.parameters(index)).vertices

    def pieces(self, size: int) -> Iterator[NDArray[np.floating]]:
        """The vertices in pieces of `size` bodies; each piece overwrites the one before."""
        buffer = None
        for start in range(0, self.length, size):
            buffer = self.body.vertices_into(buffer, *self.parameters(slice(start, min(start + size, self.length))))
            yield buffer


def pieces(bodies: PosedSequence | NDArray[Any], size: int) -> Iterator[NDArray[Any]]:
    """The vertices in pieces of up to `size` bodies; at least one piece. ValueError if size is under 1."""
    if size < 1:
        raise ValueError(f"piece: expected 1 body or more, got {size}")
    if isinstance(bodies, PosedSequence) and len(bodies):
        yield from bodies.pieces(size)
    else:
        for start in range(0, max(len(bodies), 1), size):
            yield bodies[start : start + size]


def rows_of(array: NDArray[Any], index: Index) -> NDArray[Any]:
    """Rows of an array; a single row is shared by all bodies."""
    return array if len(array) == 1 else array[index]
