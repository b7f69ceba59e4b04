"""Pressure maps: the pressure of a body's samples, summed on the cells of a mat under it."""

from __future__ import annotations

from typing import Any, Protocol

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ipman_rs.checks import real_array

from .numpy_or_torch import numpy_or_torch
from .points import Array, points


class Mat(Protocol):
    """A mat on the ground with square cells, such as `ipman_rs.data.PressureMaps`: the point of cell (i, j) is
    origin + (i + ½) cell e1 + (j + ½) cell e2. A mat that was moved has one row of origin, e1 and e2 per body."""

    @property
    def values(self) -> NDArray[Any]: ...  # (..., H, W)
    @property
    def origin(self) -> NDArray[Any]: ...  # (3,) or (B, 3) m
    @property
    def e1(self) -> NDArray[Any]: ...  # (3,) or (B, 3)
    @property
    def e2(self) -> NDArray[Any]: ...  # (3,) or (B, 3)
    @property
    def cell(self) -> float: ...  # m


@numpy_or_torch
def pressure_map(samples: ArrayLike, pressure: ArrayLike, mat: Mat) -> Any:
    """The pressure on each cell: samples (..., S, 3) m and their pressure (..., S) -> (..., H, W), in its unit.

    Samples off the mat are left out. A body that is not finite has a map of NaN.

    Raises:
        ValueError: the shapes do not match.
    """
    where = points("samples", samples)
    weights = real_array("pressure", pressure).astype(np.float64)
    if weights.shape != where.shape[:-1]:
        raise ValueError(f"pressure: expected one per sample, {where.shape[:-1]}, got {weights.shape}")
    height, width = mat.values.shape[-2:]
    bodies = where.reshape(-1, *where.shape[-2:]), weights.reshape(-1, weights.shape[-1])
    maps = np.full((len(bodies[0]), height * width), np.nan)
    for number, (cell_sums, body, weight) in enumerate(zip(maps, *bodies, strict=True)):
        if np.isfinite(body).all():
            cells = cell_numbers(body, mat, number)
            on = cells >= 0
            cell_sums[:] = np.bincount(cells[on], weight[on], height * width)
    return maps.reshape(*where.shape[:-2], height, width)


def cell_numbers(samples: Array, mat: Mat, body: int) -> NDArray[np.int64]:
    """The number i · W + j of the cell under each sample (S, 3) of the body of this number; −1 off the mat."""
    height, width = mat.values.shape[-2:]
    origin, e1, e2 = (place[body] if place.ndim == 2 else place for place in (mat.origin, mat.e1, mat.e2))
    offset = (samples - origin) / mat.cell
    i, j = np.floor(offset @ e1), np.floor(offset @ e2)
    on = (i >= 0) & (i < height) & (j >= 0) & (j < width)
    return np.where(on, i * width + j, -1).astype(np.int64)


def normalised(values: Array, axes: int | tuple[int, ...]) -> Array:
    """Values shifted and scaled to run from 0 to 1 along the axes; 0 where all are equal."""
    least = values.min(axis=axes, keepdims=True)
    span = values.max(axis=axes, keepdims=True) - least
    return (values - least) / np.where(span == 0, 1.0, span)
