"""Foot skating: how far a foot slides along the ground while it stands on it."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from ipman_rs.checks import positive

from .numpy_or_torch import AnyGround, numpy_or_torch
from .points import finite, norm, points


@numpy_or_torch
def foot_skating(feet: ArrayLike, ground: AnyGround, sequences: ArrayLike, threshold: float = 0.005) -> Any:
    """Distance moved along the ground since the previous frame, mean over the points that touch it in both frames:
    (F, N, 3) -> (F,) m per frame. Times the frame rate it is a speed.

    NaN in the first frame of a sequence, where no point touches the ground in both, and where a body is not finite.
    A shard that starts within a sequence must be given the previous frame, and leave out the value of that frame.

    Args:
        feet: points of the feet: the vertices of their soles, or joints.
        sequences: (F,) names; frames of one sequence follow each other.
        threshold: height above the ground, m, below which a point touches it.

    Raises:
        ValueError: shapes do not fit, or the threshold is not positive.
    """
    positions = finite(points("feet", feet))
    names = np.asarray(sequences)
    if positions.ndim != 3:
        raise ValueError(f"feet: expected (F, N, 3), got {positions.shape}")
    if names.shape != positions.shape[:1]:
        raise ValueError(f"sequences: expected a name per frame, ({len(positions)},), got {names.shape}")
    on_ground = ground.project(positions)
    touching = ground.signed_height(positions) < positive("threshold", threshold)
    both = touching[1:] & touching[:-1] & (names[1:] == names[:-1])[:, None]
    steps = np.where(both, norm(on_ground[1:] - on_ground[:-1]), 0.0).sum(axis=-1)
    count = both.sum(axis=-1)
    means = np.full(len(positions), np.nan)
    means[1:][count > 0] = steps[count > 0] / count[count > 0]
    return means
