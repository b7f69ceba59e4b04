"""Tilt: by how much the pelvis leans another way than it should, against gravity."""

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

PELVIS = (0, 1, 2, 3)  # of SMPL, SMPL-H and SMPL-X: what turns with the root alone (pelvis, hips, first of the spine)


@numpy_or_torch
def tilt(
    estimated: ArrayLike,
    true: ArrayLike,
    ground: AnyGround,
    true_ground: AnyGround | None = None,
    pelvis: Sequence[int] = PELVIS,
) -> Any:
    """Angle between the two directions of "up", that of the estimated world and that of the true one, as the pelvis
    sees them: joints (..., J, 3) -> (...) rad, from 0 to π.

    It is the error of the pelvis' pitch and roll against gravity; a wrong heading costs nothing. The estimated
    pelvis is held against the true one by the rotation that aligns its joints best.

    Args:
        ground: of the estimated bodies, only its direction counts.
        true_ground: of the true bodies, where their world is another.
        pelvis: joints that move as one rigid piece, three or more that are not on a line.

    Raises:
        ValueError: shapes differ, or there are fewer than three joints.
    """
    first, second = map(finite, pair("joints", estimated, true))
    if len(pelvis) < 3:
        raise ValueError(f"pelvis: expected three joints or more, got {len(pelvis)}")
    rotation = similarity(second[..., list(pelvis), :], first[..., list(pelvis), :])[1]
    return _between(_up(ground), (rotation @ _up(true_ground or ground)[..., None])[..., 0])


@numpy_or_torch
def root_tilt(estimated: ArrayLike, true: ArrayLike, ground: AnyGround, true_ground: AnyGround | None = None) -> Any:
    """`tilt` from the rotations (..., 3, 3) of the roots, from the rest pose to each one's world, where a body model
    gives them. ValueError where the shapes differ."""
    first, second = (real_array("rotations", value).astype(np.float64) for value in (estimated, true))
    if first.shape != second.shape or first.shape[-2:] != (3, 3):
        raise ValueError(f"rotations: expected two arrays (..., 3, 3), got {first.shape} and {second.shape}")
    first, second = finite(first), finite(second)
    seen = (first.swapaxes(-1, -2) @ _up(ground)[..., None])[..., 0]
    truly = (second.swapaxes(-1, -2) @ _up(true_ground or ground)[..., None])[..., 0]
    return _between(seen, truly)


def _up(ground: Ground) -> Array:
    return ground.normal


def _between(first: Array, second: Array) -> Array:
    """The angle of unit vectors; exact also where they are almost one, where an arc cosine is not."""
    return np.arctan2(norm(np.cross(first, second)), (first * second).sum(axis=-1))
