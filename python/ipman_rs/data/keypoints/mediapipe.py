"""MediaPipe Pose's 33 landmarks as JSON. MediaPipe itself has no file format; `write` makes this one:

{"format": "mediapipe-pose", "image": "photo.png", "image_size": [width, height],
 "landmarks": [[x, y, z, visibility], ...],           x and y relative to the image's width and height
 "world_landmarks": [[x, y, z, visibility], ...]}     metres from between the hips, y down, z away from the camera

Read are also the names of MediaPipe's APIs (`pose_landmarks`, `poseLandmarks`, `pose_world_landmarks`, ...), protobuf's
`MessageToDict` ({"landmark": [...]}), points as {"x", "y", "z", "visibility"} in a list or by their names, a bare list
of 33 points, lists of such people, and lists of such images. x and y in pixels are read, too: points are taken for
relative where no visible one is beyond ±3. Relative ones need an image size, in the file or given.
"""

from __future__ import annotations

import json
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from ipman_rs.files import write_whole

from .keypoint_format import KeypointFormat, Pixels, Sizes, relative_to_pixels
from .layouts import MEDIAPIPE_33
from .people import Array, Image, Person, check_scores, numbers, short_label, size_of, width_height

NAMES = MEDIAPIPE_33

FORMAT = "mediapipe-pose"
IMAGE_KEYS = ("landmarks", "pose_landmarks", "poseLandmarks", "landmark", "normalized_landmarks", "normalizedLandmarks")
WORLD_KEYS = ("world_landmarks", "pose_world_landmarks", "poseWorldLandmarks", "worldLandmarks")
LANDMARK_NAMES = (
    "nose", "left_eye_inner", "left_eye", "left_eye_outer", "right_eye_inner", "right_eye", "right_eye_outer",
    "left_ear", "right_ear", "mouth_left", "mouth_right", *(str(name) for name in NAMES[11:31]), "left_foot_index",
    "right_foot_index",
)  # fmt: skip
AROUND = ("frames", "results", "poses")
ALL_SEEN = "no visibility: all points taken as seen"


def matches(content: Any) -> bool:
    return bool(_frames(content))


def images(content: Any, source: str) -> list[Image]:
    """A row for each image of the file."""
    frames = _frames(content)
    size = _size(content, source) if isinstance(content, dict) else None
    pictures = []
    for index, frame in enumerate(frames):
        place = source if len(frames) == 1 else f"{source}: frame {index}"
        entry = {"landmarks": frame} if isinstance(frame, list) else frame or {}
        pictures.append(Image(place, _people(entry, place), _size(entry, place) or size))
    return pictures


def _frames(content: Any) -> list[Any]:
    """The images of a file: objects with one of the keys, in a list or by name, or lists of points or of people."""
    if isinstance(content, dict):
        if _has_landmarks(content):
            return [content]
        inside = next((content[key] for key in AROUND if isinstance(content.get(key), list)), [*content.values()])
        return inside if _are_frames(inside) else []
    if not isinstance(content, list) or not content:
        return []
    if _are_frames(content):
        return content
    return [content] if _is_point(content[0]) or _is_person(content[0]) else []


def _has_landmarks(content: Any) -> bool:
    return isinstance(content, dict) and any(key in content for key in (*IMAGE_KEYS, *WORLD_KEYS))


def _are_frames(content: list[Any]) -> bool:
    """Whether these are images; one in which nobody was found may be null or empty."""
    return any(map(_has_landmarks, content)) and all(not frame or isinstance(frame, dict) for frame in content)


def _is_point(value: Any) -> bool:
    return isinstance(value, dict) and "x" in value and "y" in value


def _is_person(value: Any) -> bool:
    """Whether this is a list of points, as objects or as three or four numbers, or an object around one."""
    if isinstance(value, dict):
        return any(isinstance(value.get(key), list) for key in ("landmark", "landmarks"))
    return isinstance(value, list) and len(value) > 0 and (_is_point(value[0]) or isinstance(value[0], list))


def _size(given: dict[str, Any], place: str) -> tuple[float, float] | None:
    size = given.get("image_size")
    if isinstance(size, (dict, list)):
        return size_of(size, place) if isinstance(size, dict) else width_height(size, place)
    if size is not None:
        raise ValueError(f"{place}: image_size: expected width and height, got {short_label(size)}")
    return size_of(given, place)


def _people(given: dict[str, Any], place: str) -> list[Person | str]:
    """Everybody in one image, with their world landmarks where there are as many."""
    key = next((key for key in IMAGE_KEYS if given.get(key)), None)
    world_key = next((key for key in WORLD_KEYS if given.get(key)), None)
    if key is None:
        if world_key is None:
            return []
        raise ValueError(f"{place}: {world_key}: expected landmarks in the image, too: metres are no places in it")
    people = _listed(given[key])
    worlds = [] if world_key is None else _listed(given[world_key])
    unused = tuple(
        name
        for name in given
        if ("landmark" in name.lower() or "mask" in name.lower()) and name not in (key, world_key) and given[name]
    )
    if worlds and len(worlds) != len(people):
        worlds, unused = [], (*unused, str(world_key))
    read: list[Person | str] = []
    for index, points in enumerate(people):
        where = f"{place}: {key}" + (f"[{index}]" if len(people) > 1 else "")
        try:
            four, notes = _points(points, where)
            world = _points(worlds[index], f"{place}: {world_key}")[0] if worlds else None
            if world is not None:
                world = np.nan_to_num(world)
                world[:, 3] = world[:, 3].clip(0, 1)
            read.append(Person(NAMES, four[:, [0, 1, 3]], world, notes=notes, unused=unused))
        except ValueError as error:
            read.append(str(error))
    return read


def _listed(value: Any) -> list[Any]:
    """The people under a key: several in a list, or one."""
    if isinstance(value, list) and value and _is_person(value[0]):
        return value
    if isinstance(value, list) and value and all(point == [] for point in value):
        return []
    several = isinstance(value, list) and any(_is_person(person) for person in value)
    return value if several else [value]


def _points(points: Any, place: str) -> tuple[Array, tuple[str, ...]]:
    """A person's points (33, 4), and what was assumed of them."""
    if isinstance(points, dict):
        points = next((points[key] for key in ("landmark", "landmarks") if key in points), points)
    if isinstance(points, dict):
        points = _by_name(points, place)
    if not isinstance(points, list) or len(points) not in (len(NAMES), 4 * len(NAMES)):
        got = f"{len(points)}" if isinstance(points, list) else type(points).__name__
        raise ValueError(f"{place}: expected {len(NAMES)} points, got {got}")
    if not all(isinstance(point, (dict, list)) for point in points):
        return _visible(numbers(points, len(NAMES), 4, place), place), ()
    rows = [_four(point, f"{place}[{index}]") for index, point in enumerate(points)]
    assumed = any(row[3] is None for row in rows)
    four = numbers([[*row[:3], 1.0 if row[3] is None else row[3]] for row in rows], len(NAMES), 4, place)
    return _visible(four, place), (ALL_SEEN,) if assumed else ()


def _visible(four: Array, place: str) -> Array:
    """Points (33, 4) whose visibility can be one. ValueError for others."""
    check_scores(four[:, 1:], place)
    return four


def _by_name(points: dict[str, Any], place: str) -> list[Any]:
    """Points by MediaPipe's names of them, in any case, in its order."""
    given = {str(name).lower().replace(" ", "_"): point for name, point in points.items()}
    missing = [name for name in LANDMARK_NAMES if name not in given]
    if missing:
        raise ValueError(f"{place}: expected MediaPipe's {len(NAMES)} points, got none of the name {missing[0]}")
    return [given[name] for name in LANDMARK_NAMES]


def _four(point: Any, place: str) -> list[Any]:
    """x, y, z and visibility, None where it is not known."""
    if isinstance(point, list):
        if len(point) not in (2, 3, 4):
            raise ValueError(f"{place}: expected x, y, z and visibility, got {len(point)} numbers")
        return [*point[:3], *([0.0] if len(point) == 2 else []), point[3] if len(point) == 4 else None]
    if not _is_point(point):
        raise ValueError(f"{place}: expected x and y, got {_keys(point)}")
    seen = next((point[key] for key in ("visibility", "score", "presence") if point.get(key) is not None), None)
    return [point["x"], point["y"], point.get("z", 0.0), seen]


def _keys(point: Iterable[Any]) -> str:
    return ", ".join(str(key) for key in point)[:80] or "nothing"


def write(path: str | Path, image: str, size: tuple[int, int], landmarks: Array, world: Array) -> None:
    """One person's landmarks (33, 4), relative to the image, and world landmarks (33, 4)."""
    content = {
        "format": FORMAT,
        "image": image,
        "image_size": list(size),
        "landmarks": landmarks.round(6).tolist(),
        "world_landmarks": world.round(6).tolist(),
    }
    write_whole(path, json.dumps(content, indent=1) + "\n")


def _pixels(people: Sequence[Array], sizes: Sizes, source: str) -> Pixels:
    """That landmarks are relative to the image is the format, and needs no note."""
    return relative_to_pixels(people, sizes, source)[0], []


MEDIAPIPE = KeypointFormat(NAMES, matches, images, pixels=_pixels)
