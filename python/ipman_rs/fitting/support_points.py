"""The points that tell what holds a body up: those of its soles, and the joints that carry its mass. One set for all
terms that ask, so that each evaluation poses them once."""

from __future__ import annotations

from functools import lru_cache

import ipman_rs.torch as ipt

from ..body.landmarks import SIDES
from .landmarks import Landmarks

SOLE = ("heel", "big_toe", "small_toe")
_JOINTS = ("shoulder", "elbow", "wrist", "hip", "knee", "ankle")
NAMES = ("mid_hip", "neck", "head", *(f"{side}_{point}" for side in SIDES for point in (*SOLE, *_JOINTS)))


@lru_cache(maxsize=4)
def support_points(body: ipt.BodyModel) -> Landmarks:
    """The points `NAMES`. Raises ValueError for a body without feet."""
    return Landmarks(body, NAMES)
