"""The ten body parts of the paper, read off a model's skinning weights.

Each joint belongs to one part. A vertex carries, for every part, the sum of its skinning weights on that part's
joints; a face belongs to the part with the largest sum over its three vertices. The shoulder's upper arm starts at
the shoulder joint: the collar bone is torso, otherwise the boundaries at neck and shoulder would touch.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

PART_NAMES = (
    "head",
    "torso",
    "left_upper_arm",
    "right_upper_arm",
    "left_forearm",
    "right_forearm",
    "left_thigh",
    "right_thigh",
    "left_lower_leg",
    "right_lower_leg",
)

_LIMB_OF_JOINT = {
    "shoulder": "upper_arm",
    "elbow": "forearm",
    "wrist": "forearm",
    "hand": "forearm",
    "thumb": "forearm",
    "index": "forearm",
    "middle": "forearm",
    "ring": "forearm",
    "pinky": "forearm",
    "hip": "thigh",
    "knee": "lower_leg",
    "ankle": "lower_leg",
    "foot": "lower_leg",
}


def part_of_joint(joint: str) -> str:
    """Name of the part that a joint moves: `left_index2` -> `left_forearm`, `jaw` -> `head`, `spine1` -> `torso`."""
    if joint in ("neck", "head", "jaw") or "eye" in joint:
        return "head"
    side, _, place = joint.partition("_")
    limb = _LIMB_OF_JOINT.get(place.rstrip("123"))
    return f"{side}_{limb}" if limb else "torso"


def face_parts(
    faces: NDArray[np.int64],
    weights: NDArray[np.float64],
    joint_names: Sequence[str],
    joint_parts: Mapping[str, str] | None = None,
) -> NDArray[np.int64]:
    """Part index (F,) in `PART_NAMES` of every face, from `faces` (F, 3) and the skinning `weights` (V, J).

    joint_parts: the parts of joints whose names tell none.
    """
    parts = [(joint_parts or {}).get(joint) or part_of_joint(joint) for joint in joint_names]
    belongs = np.array([[own == part for part in PART_NAMES] for own in parts], float)
    return (weights @ belongs)[faces].sum(1).argmax(1)
