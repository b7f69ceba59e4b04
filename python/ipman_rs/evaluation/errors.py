"""Errors of joints and surfaces, in the units of the points (metres). Points are (..., N, 3), errors (...)."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

Array = NDArray[np.floating]


def pve(estimated: ArrayLike, true: ArrayLike, root: ArrayLike | None = None, true_root: ArrayLike | None = None):
    """Per-vertex error: the mean distance of corresponding points. With roots (..., 3), such as the pelvis, given, both
    are moved there first. ValueError where the shapes differ."""
    estimated, true = _pair(estimated, true)
    if root is not None and true_root is not None:
        estimated = estimated - np.asarray(root, float)[..., None, :]
        true = true - np.asarray(true_root, float)[..., None, :]
    return np.linalg.norm(estimated - true, axis=-1).mean(axis=-1)


def mpjpe(estimated: ArrayLike, true: ArrayLike, root: int | None = 0):
    """Mean per-joint position error, after moving the joint `root` of both to the origin; None: as they stand."""
    estimated, true = _pair(estimated, true)
    if root is None:
        return pve(estimated, true)
    return pve(estimated, true, estimated[..., root, :], true[..., root, :])


def pa_mpjpe(estimated: ArrayLike, true: ArrayLike):
    """MPJPE after the similarity (rotation, scale, translation) that brings the estimated joints closest."""
    estimated, true = _pair(estimated, true)
    return pve(aligned(estimated, true), true)


def aligned(points: ArrayLike, target: ArrayLike) -> Array:
    """Points (..., N, 3) moved by the similarity that brings them closest to the target in the least-squares sense."""
    points, target = _pair(points, target)
    scale, rotation, shift = similarity(points, target)
    return scale[..., None, None] * points @ rotation.swapaxes(-1, -2) + shift[..., None, :]


def similarity(points: Array, target: Array) -> tuple[Array, Array, Array]:
    """scale (...), rotation (..., 3, 3) and shift (..., 3) that minimise Σ |scale · R p + shift − q|² (Umeyama, 1991).

    Never a reflection. Points that are all one have scale 1.
    """
    middle, goal = points.mean(axis=-2, keepdims=True), target.mean(axis=-2, keepdims=True)
    p, q = points - middle, target - goal
    u, sizes, vt = np.linalg.svd(q.swapaxes(-1, -2) @ p)
    signs = np.ones_like(sizes)
    signs[..., 2] = np.sign(np.linalg.det(u @ vt))
    rotation = (u * signs[..., None, :]) @ vt
    spread = (p**2).sum(axis=(-2, -1))
    scale = np.where(spread > 0, (sizes * signs).sum(axis=-1) / np.where(spread > 0, spread, 1), 1.0)
    shift = goal[..., 0, :] - scale[..., None] * (rotation @ middle.swapaxes(-1, -2))[..., 0]
    return scale, rotation, shift


def _pair(estimated: ArrayLike, true: ArrayLike) -> tuple[Array, Array]:
    first, second = np.asarray(estimated, float), np.asarray(true, float)
    if first.shape != second.shape or first.ndim < 2 or first.shape[-1] != 3:
        raise ValueError(f"points: expected two arrays of one shape (..., N, 3), got {first.shape} and {second.shape}")
    return first, second
