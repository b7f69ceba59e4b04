"""COCO's JSON with 17 keypoints: an annotation file, a list of results, or a single person.

{"images": [{"id", "file_name", "width", "height"}, ...], "annotations": [{"image_id", "keypoints": [x, y, v, ...]}]}
[{"image_id", "keypoints": [x, y, score, ...]}, ...]        {"keypoints": [[x, y], ...], "keypoint_scores": [...]}

Every image with labelled people becomes a row. People without an image_id are taken to be in the same image.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from .people import Array, Image, confident, numbers

NAMES = (
    "nose", "left_eye", "right_eye", "left_ear", "right_ear", "left_shoulder", "right_shoulder", "left_elbow",
    "right_elbow", "left_wrist", "right_wrist", "left_hip", "right_hip", "left_knee", "right_knee", "left_ankle",
    "right_ankle",
)  # fmt: skip


def matches(content: Any) -> bool:
    people = entries(content)
    return people is not None and not (people and "foot_kpts" in people[0]) and _count(people) != 133


def images(content: Any, source: str) -> list[Image]:
    return by_image(content, source, lambda entry, place: points_of(entry, len(NAMES), place))


def entries(content: Any) -> list[Any] | None:
    """The people of a file in COCO's form, None if it is none."""
    if isinstance(content, dict) and "annotations" in content:
        content = content["annotations"]
    elif isinstance(content, dict) and "keypoints" in content:
        content = [content]
    if not isinstance(content, list) or not all(isinstance(entry, dict) for entry in content):
        return None
    return content if not content or "keypoints" in content[0] else None


def _count(people: list[Any]) -> int:
    """How many keypoints the first person has."""
    keypoints = people[0]["keypoints"] if people else []
    flat = isinstance(keypoints, list) and not (keypoints and isinstance(keypoints[0], list))
    return len(keypoints) // 3 if flat else len(keypoints)


def by_image(content: Any, source: str, person: Callable[[Any, str], Array]) -> list[Image]:
    """People sorted into their images; `person` turns an entry into points (K, 3)."""
    listed = content.get("images", []) if isinstance(content, dict) else []
    described = {image["id"]: image for image in listed if isinstance(image, dict) and "id" in image}
    found: dict[Any, Image] = {}
    for index, entry in enumerate(entries(content) or []):
        if entry.get("num_keypoints") == 0:  # COCO lists people without keypoints, too
            continue
        identity = entry.get("image_id")
        if identity not in found:
            about = described.get(identity, {})
            label = about.get("file_name", identity)
            size = (float(about["width"]), float(about["height"])) if {"width", "height"} <= set(about) else None
            found[identity] = Image(source if label is None else f"{source}: {label}", [], size)
        found[identity].people.append(person(entry, f"{source}: annotations[{index}]"))
    return list(found.values()) or [Image(source, [])]


def points_of(entry: Any, count: int, place: str, field: str = "keypoints") -> Array:
    """Points (count, 3): x, y and score, or x, y and COCO's flag (0 not labelled, 1 hidden, 2 visible)."""
    place = f"{place}: {field}"
    if field not in entry:
        raise ValueError(f"{place}: expected {count} points, got none")
    if field == "keypoints" and "keypoint_scores" in entry:
        points = numbers(entry[field], count, 2, place)
        points = np.concatenate([points, numbers(entry["keypoint_scores"], count, 1, f"{place}: scores")], axis=1)
    else:
        points = numbers(entry[field], count, 3, place)
    return confident(points, place)
