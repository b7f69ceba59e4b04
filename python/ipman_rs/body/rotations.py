"""Rotation matrices from the two ways in which body poses are written: axis-angle and 6D."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray


def from_axis_angle(axis_angle: NDArray[np.float64]) -> NDArray[np.float64]:
    """Rotation vectors (..., 3) in radians -> matrices (..., 3, 3), by Rodrigues' formula; exact at zero."""
    angle = np.linalg.norm(axis_angle, axis=-1)[..., None, None]
    x, y, z = np.moveaxis(axis_angle, -1, 0)
    zero = np.zeros_like(x)
    cross = np.stack([zero, -z, y, z, zero, -x, -y, x, zero], -1).reshape(*axis_angle.shape, 3)
    # sin(a)/a and (1 - cos a)/a^2 written with sinc, which is defined at 0
    return np.eye(3) + np.sinc(angle / np.pi) * cross + 0.5 * np.sinc(angle / (2.0 * np.pi)) ** 2 * (cross @ cross)


def from_6d(columns: NDArray[np.float64]) -> NDArray[np.float64]:
    """6D rotations (..., 6) -> matrices (..., 3, 3).

    The six numbers are the first two *columns* of the matrix, one after the other (Zhou et al., "On the Continuity of
    Rotation Representations in Neural Networks", 2019, eq. 15), made orthonormal by Gram-Schmidt. PyTorch3D stores the
    first two rows (transpose its matrices); SPIN-like code interleaves the columns (`x.reshape(..., 3, 2)`).
    """
    first = _unit(columns[..., :3])
    second = columns[..., 3:]
    second = _unit(second - (first * second).sum(-1, keepdims=True) * first)
    return np.stack([first, second, np.cross(first, second)], -1)


def to_6d(matrices: NDArray[np.float64]) -> NDArray[np.float64]:
    """The first two columns (..., 6) of rotation matrices (..., 3, 3)."""
    return np.concatenate([matrices[..., 0], matrices[..., 1]], -1)


def _unit(vectors: NDArray[np.float64]) -> NDArray[np.float64]:
    return vectors / np.linalg.norm(vectors, axis=-1, keepdims=True)
