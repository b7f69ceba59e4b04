"""What metrics are given: points of bodies, checked, with a body that is not finite made NaN as a whole."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ipman_rs.arrays import plain

Array = NDArray[np.float64]


def points(name: str, value: ArrayLike) -> Array:
    """(..., N, 3) in float64, a copy. ValueError for another shape, or no points; TypeError for what is no number."""
    array = plain(name, value).astype(np.float64)
    if array.ndim < 2 or array.shape[-1] != 3 or not array.shape[-2]:
        raise ValueError(f"{name}: expected points (..., N, 3), got {array.shape}")
    array[~np.isfinite(array).all(axis=(-2, -1))] = np.nan
    return array


def pair(name: str, estimated: ArrayLike, true: ArrayLike) -> tuple[Array, Array]:
    """Two arrays of corresponding points, of one shape (..., N, 3)."""
    _same(name, estimated, true, "(..., N, 3)")
    return points(name, estimated), points(name, true)


def vector(name: str, value: ArrayLike) -> Array:
    """(..., 3) in float64, a copy."""
    array = plain(name, value)
    if not array.ndim or array.shape[-1] != 3:
        raise ValueError(f"{name}: expected (..., 3), got {array.shape}")
    return points(name, array[..., None, :])[..., 0, :]


def vectors(name: str, estimated: ArrayLike, true: ArrayLike) -> tuple[Array, Array]:
    """Two arrays of one shape (..., 3)."""
    _same(name, estimated, true, "(..., 3)")
    return vector(name, estimated), vector(name, true)


def norm(difference: NDArray[Any]) -> Array:
    """Lengths of (..., 3)."""
    return np.linalg.norm(difference, axis=-1)


def _same(name: str, estimated: ArrayLike, true: ArrayLike, expected: str) -> None:
    first, second = plain(name, estimated).shape, plain(name, true).shape
    if first != second:
        raise ValueError(f"{name}: expected two arrays of one shape {expected}, got {first} and {second}")
