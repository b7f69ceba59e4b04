"""COCO-WholeBody's JSON with 133 keypoints, in one list or as body, feet, face and hands; else as `coco`.

The 68 points of the face are not used.
"""

from __future__ import annotations

from typing import Any

from . import coco
from .coco import images
from .keypoint_format import KeypointFormat
from .layouts import COCO_WHOLEBODY_133

NAMES = COCO_WHOLEBODY_133

__all__ = ["NAMES", "images", "matches"]


def matches(content: Any) -> bool:
    people = coco.entries(content)
    return bool(people) and ("foot_kpts" in people[0] or _count(people[0].get("keypoints")) == len(NAMES))


def _count(keypoints: Any) -> int:
    """How many keypoints a person has."""
    if not isinstance(keypoints, list):
        return 0
    flat = not (keypoints and isinstance(keypoints[0], (list, dict)))
    return len(keypoints) // 3 if flat else len(keypoints)


COCO_WHOLEBODY = KeypointFormat(NAMES, matches, images)
