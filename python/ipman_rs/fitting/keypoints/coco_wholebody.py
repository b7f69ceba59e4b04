"""COCO-WholeBody's JSON with 133 keypoints, in one list or as body, feet, face and hands; else as `coco`.

The 68 points of the face are not used.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from . import coco
from .hand import hand
from .people import Array, Image

FEET = tuple(f"{side}_{point}" for side in ("left", "right") for point in ("big_toe", "small_toe", "heel"))
NAMES = (*coco.NAMES, *FEET, *(None,) * 68, *hand("left"), *hand("right"))
PARTS = {"keypoints": 17, "foot_kpts": 6, "face_kpts": 68, "lefthand_kpts": 21, "righthand_kpts": 21}


def matches(content: Any) -> bool:
    return coco.entries(content) is not None and not coco.matches(content)


def images(content: Any, source: str) -> list[Image]:
    return coco.by_image(content, source, _person)


def _person(entry: Any, place: str) -> Array:
    if "foot_kpts" not in entry:
        return coco.points_of(entry, len(NAMES), place)
    return np.concatenate([coco.points_of(entry, count, place, field) for field, count in PARTS.items()])
