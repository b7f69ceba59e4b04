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
    """Way along the ground from the frame before, mean over the points that touch it in both frames: (F, N, 3) -> (F,)
    m a frame. Times the frame rate it is a speed.

    NaN in the first frame of a sequence, where no point touches the ground in both, and where a body is not finite.
    A shard that starts within a sequence must be given the frame before, and leave that frame's figure out.

    Args:
        feet: points of the feet: the vertices of their soles, or joints.
        sequences: (F,) names; frames of one sequence follow each other.
        threshold: a point touches the ground when it is lower than this above it, m.

    Raises:
        ValueError: shapes do not fit, or the threshold is not positive.
    """
    way = finite(points("feet", feet))
    names = np.asarray(sequences)
    if way.ndim != 3:
        raise ValueError(f"feet: expected (F, N, 3), got {way.shape}")
    if names.shape != way.shape[:1]:
        raise ValueError(f"sequences: expected a name a frame, ({len(way)},), got {names.shape}")
    on_ground = ground.project(way)
    touching = ground.signed_height(way) < positive("threshold", threshold)
    both = touching[1:] & touching[:-1] & (names[1:] == names[:-1])[:, None]
    steps = np.where(both, norm(on_ground[1:] - on_ground[:-1]), 0.0).sum(axis=-1)
    number = both.sum(axis=-1)
    found = np.full(len(way), np.nan)
    found[1:][number > 0] = steps[number > 0] / number[number > 0]
    return found
