"""The similarity that brings points closest to others (Umeyama, 1991)."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from .numpy_or_torch import numpy_or_torch
from .points import Array, finite, pair


@numpy_or_torch
def similarity(points: ArrayLike, target: ArrayLike) -> Any:
    """scale (...), rotation (..., 3, 3) and shift (..., 3) that minimise Σ |scale · R p + shift − q|², for points and
    target (..., N, 3).

    Never a reflection. If all points coincide the scale is 1. NaN where a point is not finite.

    Raises:
        ValueError: the shapes differ.
    """
    return _similarity(*pair("points", points, target))


@numpy_or_torch
def aligned(points: ArrayLike, target: ArrayLike) -> Any:
    """Points (..., N, 3) moved by the similarity that brings them closest to the target.

    Raises:
        ValueError: the shapes differ.
    """
    return align(*pair("points", points, target))


def align(points: Array, target: Array) -> Array:
    """`aligned` of checked arrays."""
    scale, rotation, shift = _similarity(points, target)
    return scale[..., None, None] * points @ rotation.swapaxes(-1, -2) + shift[..., None, :]


def _similarity(points: Array, target: Array) -> tuple[Array, Array, Array]:
    points, target = finite(points), finite(target)
    middle, goal = points.mean(axis=-2, keepdims=True), target.mean(axis=-2, keepdims=True)
    p, q = points - middle, target - goal
    covariance = q.swapaxes(-1, -2) @ p
    known = np.isfinite(covariance).all(axis=(-2, -1), keepdims=True)
    u, sizes, vt = np.linalg.svd(np.where(known, covariance, np.eye(3)))  # which would not converge on NaN
    signs = np.ones_like(sizes)
    signs[..., 2] = np.sign(np.linalg.det(u @ vt))
    rotation = np.where(known, (u * signs[..., None, :]) @ vt, np.nan)
    spread = (p**2).sum(axis=(-2, -1))
    scale = np.where(spread == 0, 1.0, (sizes * signs).sum(axis=-1) / np.where(spread == 0, 1.0, spread))
    shift = goal[..., 0, :] - scale[..., None] * (rotation @ middle.swapaxes(-1, -2))[..., 0]
    return scale, rotation, shift
