"""MediaPipe Pose's 33 landmarks as JSON. MediaPipe itself has no file format; `write` makes this one:

{"format": "mediapipe-pose", "image": "photo.png", "image_size": [width, height],
 "landmarks": [[x, y, z, visibility], ...],           x and y relative to the image's width and height
 "world_landmarks": [[x, y, z, visibility], ...]}     metres from between the hips, y down, z away from the camera

Read are also `pose_landmarks`, `poseLandmarks`, `pose_world_landmarks`, `poseWorldLandmarks` and `worldLandmarks`,
points as {"x", "y", "z", "visibility"}, a bare list of 33 points, and x and y in pixels: they are taken for relative
where no visible one is beyond ±3. Relative ones need an image size, in the file or given.
"""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np

from .people import Array, Image, confident, numbers


def _both(point: str) -> tuple[str, str]:
    return f"left_{point}", f"right_{point}"


NAMES = (
    "nose", None, "left_eye", None, None, "right_eye", None, *_both("ear"), None, None, *_both("shoulder"),
    *_both("elbow"), *_both("wrist"), *_both("pinky"), *_both("index"), *_both("thumb"), *_both("hip"), *_both("knee"),
    *_both("ankle"), *_both("heel"), *_both("big_toe"),
)  # fmt: skip
FORMAT = "mediapipe-pose"
IMAGE_KEYS = ("landmarks", "pose_landmarks", "poseLandmarks")
WORLD_KEYS = ("world_landmarks", "pose_world_landmarks", "poseWorldLandmarks", "worldLandmarks")
RELATIVE = 3.0


def matches(content: Any) -> bool:
    if isinstance(content, dict):
        return any(key in content for key in IMAGE_KEYS)
    return (
        isinstance(content, list)
        and len(content) > 0
        and isinstance(content[0], dict)
        and {"x", "y"} <= set(content[0])
    )


def images(content: Any, source: str) -> list[Image]:
    """A single image; points relative to it are scaled where the file has its size."""
    given = content if isinstance(content, dict) else {"landmarks": content}
    found = _points(given, IMAGE_KEYS, source)
    if found is None:
        return [Image(source, [])]
    size = given.get("image_size")
    width_height = None if size is None else tuple(numbers(size, 1, 2, f"{source}: image_size")[0].tolist())
    image = Image(source, [found[:, [0, 1, 3]]], width_height, _points(given, WORLD_KEYS, source))
    return [image]


def is_relative(points: Array) -> bool:
    """Whether the x and y of points (33, 3) are shares of the image's width and height."""
    seen = points[points[:, 2] > 0.5] if (points[:, 2] > 0.5).any() else points
    return bool((abs(seen[:, :2]) <= RELATIVE).all())


def _points(given: dict[str, Any], keys: tuple[str, ...], source: str) -> Array | None:
    """The points (33, 4), None if there are none under these keys."""
    key = next((key for key in keys if given.get(key)), None)
    if key is None:
        return None
    points = given[key]
    if isinstance(points, dict):
        points = points.get("landmark", points)
    if isinstance(points, list) and len(points) == 1:  # a list of people with one of them
        points = points[0]
    place = f"{source}: {key}"
    if isinstance(points, list):
        points = [_four(point, f"{place}[{index}]") for index, point in enumerate(points)]
    four = numbers(points, len(NAMES), 4, place)
    confident(four[:, 1:], place)
    return np.column_stack([four[:, :3], four[:, 3].clip(0, 1)])


def _four(point: Any, place: str) -> Any:
    if not isinstance(point, dict):
        return point
    if not {"x", "y"} <= set(point):
        raise ValueError(f"{place}: expected x and y, got {', '.join(point) or 'nothing'}")
    return [point["x"], point["y"], point.get("z", 0.0), point.get("visibility", 1.0)]


def write(path: str | Path, image: str, size: tuple[int, int], landmarks: Array, world: Array) -> None:
    """One person's landmarks (33, 4), relative to the image, and world landmarks (33, 4)."""
    content = {
        "format": FORMAT,
        "image": image,
        "image_size": list(size),
        "landmarks": landmarks.round(6).tolist(),
        "world_landmarks": world.round(6).tolist(),
    }
    Path(path).write_text(json.dumps(content, indent=1) + "\n")
