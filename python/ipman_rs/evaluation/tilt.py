"""Tilt: the error of the pelvis' orientation relative to gravity."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from ipman_rs.checks import real_array
from ipman_rs.ground import Ground

from .numpy_or_torch import AnyGround, numpy_or_torch
from .points import Array, finite, norm, pair
from .procrustes import similarity

PELVIS = (0, 1, 2, 3)  # of SMPL, SMPL-H and SMPL-X: joints that only the root turns (pelvis, hips, lowest of the spine)


@numpy_or_torch
def tilt(
    estimated: ArrayLike,
    true: ArrayLike,
    ground: AnyGround,
    true_ground: AnyGround | None = None,
    pelvis: Sequence[int] = PELVIS,
) -> Any:
    """Angle between the "up" of the estimated world and that of the true world, both in the frame of the pelvis: joints
    (..., J, 3) -> (...) rad, from 0 to π.

    It is the error of the pelvis' pitch and roll relative to gravity; a wrong heading does not count. The two pelvis
    frames are related by the rotation that best aligns the joints of the pelvis.

    Args:
        ground: of the estimated bodies; only its direction counts.
        true_ground: of the true bodies, if their world is another.
        pelvis: joints that move as one rigid piece, three or more, not on one line.

    Raises:
        ValueError: the shapes differ, or there are fewer than three joints.
    """
    first, second = map(finite, pair("joints", estimated, true))
    if len(pelvis) < 3:
        raise ValueError(f"pelvis: expected three joints or more, got {len(pelvis)}")
    rotation = similarity(second[..., list(pelvis), :], first[..., list(pelvis), :])[1]
    return _between(_up(ground), (rotation @ _up(true_ground or ground)[..., None])[..., 0])


@numpy_or_torch
def root_tilt(estimated: ArrayLike, true: ArrayLike, ground: AnyGround, true_ground: AnyGround | None = None) -> Any:
    """`tilt` from root rotations (..., 3, 3) of a body model, from the rest pose to the body's world: (...) rad.

    Raises:
        ValueError: the shapes differ.
    """
    first, second = (real_array("rotations", value).astype(np.float64) for value in (estimated, true))
    if first.shape != second.shape or first.shape[-2:] != (3, 3):
        raise ValueError(f"rotations: expected two arrays (..., 3, 3), got {first.shape} and {second.shape}")
    first, second = finite(first), finite(second)
    estimated_up = (first.swapaxes(-1, -2) @ _up(ground)[..., None])[..., 0]
    true_up = (second.swapaxes(-1, -2) @ _up(true_ground or ground)[..., None])[..., 0]
    return _between(estimated_up, true_up)


def _up(ground: Ground) -> Array:
    return ground.normal


def _between(first: Array, second: Array) -> Array:
    """The angle between unit vectors, rad. Unlike an arc cosine it is exact for almost equal vectors, too."""
    return np.arctan2(norm(np.cross(first, second)), (first * second).sum(axis=-1))
