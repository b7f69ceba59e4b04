"""Joint names of the body models, in the order of their files."""

from __future__ import annotations


def _fingers(side: str) -> list[str]:
    return [f"{side}_{finger}{i}" for finger in ("index", "middle", "pinky", "ring", "thumb") for i in (1, 2, 3)]


BODY = (
    "pelvis", "left_hip", "right_hip", "spine1", "left_knee", "right_knee", "spine2", "left_ankle", "right_ankle",
    "spine3", "left_foot", "right_foot", "neck", "left_collar", "right_collar", "head", "left_shoulder",
    "right_shoulder", "left_elbow", "right_elbow", "left_wrist", "right_wrist",
)  # fmt: skip
SMPL = (*BODY, "left_hand", "right_hand")
SMPLH = (*BODY, *_fingers("left"), *_fingers("right"))
SMPLX = (*BODY, "jaw", "left_eye_smplhf", "right_eye_smplhf", *_fingers("left"), *_fingers("right"))

LEFT_HAND, RIGHT_HAND = tuple(_fingers("left")), tuple(_fingers("right"))

SMPL_PARENTS = (-1, 0, 0, 0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 9, 9, 12, 13, 14, 16, 17, 18, 19, 20, 21)
