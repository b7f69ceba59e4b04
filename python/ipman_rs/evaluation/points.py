"""Checked arrays of points and vectors, the arguments of metrics."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ipman_rs.checks import real_array

Array = NDArray[np.float64]


def points(name: str, value: ArrayLike) -> Array:
    """`value` as points (..., N, 3) in float64. ValueError for another shape or no points; TypeError if not numbers."""
    array = real_array(name, value)
    if array.ndim < 2 or array.shape[-1] != 3 or not array.shape[-2]:
        raise ValueError(f"{name}: expected points (..., N, 3), got {array.shape}")
    return array.astype(np.float64, copy=False)


def pair(name: str, estimated: ArrayLike, true: ArrayLike) -> tuple[Array, Array]:
    """Two arrays of corresponding points, of the same shape (..., N, 3). ValueError where the shapes differ."""
    first, second = real_array(name, estimated), real_array(name, true)
    _same(name, first, second, "(..., N, 3)")
    return points(name, first), points(name, second)


def vector(name: str, value: ArrayLike) -> Array:
    """`value` as vectors (..., 3) in float64. ValueError for another shape."""
    array = real_array(name, value)
    if not array.ndim or array.shape[-1] != 3:
        raise ValueError(f"{name}: expected (..., 3), got {array.shape}")
    return array.astype(np.float64, copy=False)


def vectors(name: str, estimated: ArrayLike, true: ArrayLike) -> tuple[Array, Array]:
    """Two arrays of vectors, of the same shape (..., 3). ValueError where the shapes differ."""
    first, second = real_array(name, estimated), real_array(name, true)
    _same(name, first, second, "(..., 3)")
    return vector(name, first), vector(name, second)


def finite(bodies: Array) -> Array:
    """Bodies (..., N, 3); a body with a coordinate that is not finite is NaN throughout."""
    return np.where(np.isfinite(bodies).all(axis=(-2, -1), keepdims=True), bodies, np.nan)


def norm(difference: NDArray[Any]) -> Array:
    """Lengths of (..., 3), NaN where one is not finite."""
    x, y, z = (difference[..., axis] for axis in range(3))  # a sum along an axis of 3 takes several times as long
    length = np.sqrt(x * x + y * y + z * z)
    return np.where(np.isfinite(length), length, np.nan)


def _same(name: str, first: NDArray[Any], second: NDArray[Any], expected: str) -> None:
    if first.shape != second.shape:
        raise ValueError(f"{name}: expected two arrays of one shape {expected}, got {first.shape} and {second.shape}")
