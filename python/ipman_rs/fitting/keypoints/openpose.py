"""OpenPose's JSON with BODY_25 and, if it has them, the hands: one file an image, several people in it.

{"people": [{"pose_keypoints_2d": [x, y, confidence, ...], "hand_left_keypoints_2d": [...], ...}, ...]}
"""

from __future__ import annotations

from typing import Any

import numpy as np

from .hand import hand
from .people import Array, Image, confident, numbers

BODY_25 = (
    "nose", "mid_shoulder", "right_shoulder", "right_elbow", "right_wrist", "left_shoulder", "left_elbow",
    "left_wrist", "mid_hip", "right_hip", "right_knee", "right_ankle", "left_hip", "left_knee", "left_ankle",
    "right_eye", "left_eye", "right_ear", "left_ear", "left_big_toe", "left_small_toe", "left_heel",
    "right_big_toe", "right_small_toe", "right_heel",
)  # fmt: skip
NAMES = (*BODY_25, *hand("left"), *hand("right"))
FIELDS = {"pose_keypoints_2d": 25, "hand_left_keypoints_2d": 21, "hand_right_keypoints_2d": 21}


def matches(content: Any) -> bool:
    return isinstance(content, dict) and "people" in content


def images(content: Any, source: str) -> list[Image]:
    people = content["people"]
    if not isinstance(people, list):
        raise ValueError(f"{source}: people: expected a list, got {type(people).__name__}")
    return [Image(source, [_person(each, f"{source}: people[{index}]") for index, each in enumerate(people)])]


def _person(person: Any, place: str) -> Array:
    if not isinstance(person, dict) or "pose_keypoints_2d" not in person:
        raise ValueError(f"{place}: expected pose_keypoints_2d, got none")
    parts = []
    for field, count in FIELDS.items():
        given = person.get(field) or ([] if field == "pose_keypoints_2d" else np.zeros((count, 3)).tolist())
        parts.append(numbers(given, count, 3, f"{place}: {field}"))
    return confident(np.concatenate(parts), place)
