"""The orders in which detectors list the points of a body, under the names of `landmarks`; None: a point not used."""

from __future__ import annotations

from .hand import hand

Layout = tuple[str | None, ...]


def _both(*points: str) -> tuple[str, ...]:
    return tuple(f"{side}_{point}" for point in points for side in ("left", "right"))


def _arm_and_leg(side: str) -> tuple[tuple[str, ...], tuple[str, ...]]:
    arm, leg = ("shoulder", "elbow", "wrist"), ("hip", "knee", "ankle")
    return tuple(f"{side}_{point}" for point in arm), tuple(f"{side}_{point}" for point in leg)


_RIGHT_ARM, _RIGHT_LEG = _arm_and_leg("right")
_LEFT_ARM, _LEFT_LEG = _arm_and_leg("left")
_FACE = (None,) * 68
_FEET = tuple(f"{side}_{point}" for side in ("left", "right") for point in ("big_toe", "small_toe", "heel"))
_HANDS = (*hand("left"), *hand("right"))

COCO_17 = ("nose", *_both("eye", "ear", "shoulder", "elbow", "wrist", "hip", "knee", "ankle"))
COCO_WHOLEBODY_133: Layout = (*COCO_17, *_FEET, *_FACE, *_HANDS)
HALPE_26 = (*COCO_17, "head_top", "mid_shoulder", "mid_hip", *_both("big_toe", "small_toe", "heel"))
HALPE_136: Layout = (*HALPE_26, *_FACE, *_HANDS)

BODY_25 = (
    "nose", "mid_shoulder", *_RIGHT_ARM, *_LEFT_ARM, "mid_hip", *_RIGHT_LEG, *_LEFT_LEG, "right_eye", "left_eye",
    "right_ear", "left_ear", *_FEET,
)  # fmt: skip
OPENPOSE_18 = (
    "nose", "mid_shoulder", *_RIGHT_ARM, *_LEFT_ARM, *_RIGHT_LEG, *_LEFT_LEG, "right_eye", "left_eye", "right_ear",
    "left_ear",
)  # fmt: skip
MPI_15: Layout = ("head_top", "mid_shoulder", *_RIGHT_ARM, *_LEFT_ARM, *_RIGHT_LEG, *_LEFT_LEG, None)

MEDIAPIPE_33: Layout = (
    "nose", None, "left_eye", None, None, "right_eye", None, *_both("ear"), None, None,
    *_both("shoulder", "elbow", "wrist", "pinky", "index", "thumb", "hip", "knee", "ankle", "heel", "big_toe"),
)  # fmt: skip
