"""The points that tell what holds a body up: those of its soles, and the joints that carry its mass. One set for all
terms that ask, so that each evaluation poses them once."""

from __future__ import annotations

from functools import lru_cache

import torch
from torch import Tensor

import ipman_rs.torch as ipt
from ipman_rs.body import BodyModel

from ..body.landmarks import SIDES, skin_points
from .landmarks import Landmarks

SOLE = ("heel", "big_toe", "small_toe")
SOLES = tuple(f"{side}_{point}" for side in SIDES for point in SOLE)
_JOINTS = ("shoulder", "elbow", "wrist", "hip", "knee", "ankle")
NAMES = ("mid_hip", "neck", "head", *(f"{side}_{point}" for side in SIDES for point in (*SOLE, "index", *_JOINTS)))
# What else than feet can rest on the floor, and how high its point is then, m: half as thick as that part of a body.
OTHERS = {
    "left_index": 0.02, "right_index": 0.02, "left_elbow": 0.05, "right_elbow": 0.05, "left_knee": 0.06,
    "right_knee": 0.06, "left_hip": 0.1, "right_hip": 0.1, "left_shoulder": 0.1, "right_shoulder": 0.1, "head": 0.1,
    "left_big_toe": 0.02, "right_big_toe": 0.02,
}  # fmt: skip
TOES = ("left_big_toe", "right_big_toe")  # of `OTHERS`: only beside another one, else the soles are down


@lru_cache(maxsize=4)
def support_points(body: ipt.BodyModel) -> Landmarks:
    """The points `NAMES`. Raises ValueError for a body without feet."""
    return Landmarks(body, NAMES)


def flat_heights(body: BodyModel) -> Tensor:
    """How high (6,) the points `SOLES` are above the ground when the soles are flat, as in the zero pose."""
    skin, vertices = skin_points(body), body.v_template
    heights = vertices[[skin[name] for name in SOLES], 1] - vertices[:, 1].min()
    return torch.as_tensor(heights, dtype=torch.float64)
