"""The zero-moment point: where a moving body's centre of pressure must be."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ipman_rs.gravity import GRAVITY
from ipman_rs.ground import Ground

Array = NDArray[np.float64]


def zero_moment_point(com: ArrayLike, acceleration: ArrayLike, ground: Ground) -> Array:
    """g(CoM) − h / (g + a·n) · (a − (a·n) n), (..., 3) m, of a centre of mass (..., 3) h above the ground.

    Of a body that does not turn: the point that the floor's force must pass through. At rest it is g(CoM); for a CoM
    that keeps its height it is the usual CoM − h/g · a. NaN in free fall, a·n ≤ −g.
    """
    points, accelerations = (np.asarray(value, float)[..., None, :] for value in (com, acceleration))
    return zero_moment_point_of_parts(np.ones(1), points, accelerations, ground)


def zero_moment_point_of_parts(masses: ArrayLike, points: ArrayLike, accelerations: ArrayLike, ground: Ground) -> Array:
    """The same of a body of P point masses (P,) at (..., P, 3) m with accelerations (..., P, 3) m/s²: (..., 3) m.

    Limbs that swing turn the whole body and so move the point, which the centre of mass alone does not know.
    """
    points = np.asarray(points, float)
    forces = np.asarray(masses, float)[:, None] * (np.asarray(accelerations, float) + GRAVITY * ground.normal)
    upward = (forces * ground.normal).sum(axis=-1, keepdims=True)
    moved = upward * points - ground.signed_height(points)[..., None] * forces
    total = upward.sum(axis=-2)
    with np.errstate(divide="ignore", invalid="ignore"):
        return np.where(total > 0, moved.sum(axis=-2) / total, np.nan)


def along_force(com: ArrayLike, force: ArrayLike, ground: Ground) -> Array:
    """Where the line of a force (..., 3) through the centre of mass meets the ground, (..., 3) m; NaN if it pulls.

    With the force that the plates measured it is the zero-moment point without a derivative.
    """
    com, force = np.asarray(com, float), np.asarray(force, float)
    upward = (force * ground.normal).sum(axis=-1, keepdims=True)
    height = ground.signed_height(com)[..., None]
    with np.errstate(divide="ignore", invalid="ignore"):
        return np.where(upward > 0, com - height * force / upward, np.nan)
