"""OpenPose's JSON: one file an image, several people in it, with the body and, if they were asked for, the hands.

{"people": [{"pose_keypoints_2d": [x, y, confidence, ...], "hand_left_keypoints_2d": [...], ...}, ...]}

The body has 25 points (BODY_25), 18 (COCO) or 15 (MPI). Read are also lists of such images, with "canvas_width" and
"canvas_height" (DWPose), and AlphaPose's objects of images by name, with "people" or "bodies" of "joints". x and y may
be pixels, or relative to the image: 0 to 1 or -1 to 1 (OpenPose's --keypoint_scale 3 and 4).
"""

from __future__ import annotations

from functools import partial
from typing import Any

import numpy as np

from ..plausibility import RELATIVE
from . import layouts
from .hand import hand
from .keypoint_format import KeypointFormat, relative_to_pixels
from .layouts import BODY_25 as BODY_25
from .layouts import Layout
from .people import (
    NOWHERE,
    Array,
    Image,
    Person,
    array,
    check_scores,
    expected_counts,
    finite_points,
    mark_not_found,
    numbers,
    read_people,
    size_of,
    track_of,
)

NAMES = (*BODY_25, *hand("left"), *hand("right"))
LAYOUTS: dict[int, tuple[str, Layout]] = {
    25: ("BODY_25", BODY_25),
    18: ("COCO", layouts.OPENPOSE_18),
    15: ("MPI", layouts.MPI_15),
}
BODY = ("pose_keypoints_2d", "pose_keypoints", "joints")
HANDS = (("hand_left_keypoints_2d", "hand_left_keypoints"), ("hand_right_keypoints_2d", "hand_right_keypoints"))
PEOPLE = ("people", "bodies")


def matches(content: Any) -> bool:
    return _is_image(content) or bool(_images(content))


def images(content: Any, source: str) -> list[Image]:
    if _is_image(content):
        return [_image(content, source)]
    return [_image(image, f"{source}: {label}") for label, image in _images(content)]


def shares(points: Array) -> tuple[Array, str]:
    """Points (K, 3) relative to the image as shares of it, and between which numbers they were.

    OpenPose finds nothing outside the image, so a number below 0 says that -1 is its left or upper end.
    """
    visible = points[:, 2] > 0
    if points[visible, :2].min(initial=0.0) < 0 or (points[~visible, :2] == -1).all(axis=1).any():
        return np.column_stack([(points[:, :2] + 1) / 2, points[:, 2]]), "-1 to 1"
    return points, "0 to 1"


def _is_image(content: Any) -> bool:
    return isinstance(content, dict) and any(key in content for key in PEOPLE)


def _images(content: Any) -> list[tuple[str, Any]]:
    """Several images in a file, with their labels."""
    if isinstance(content, dict) and content and all(_is_image(image) for image in content.values()):
        return list(content.items())
    if isinstance(content, list) and content and all(_is_image(image) for image in content):
        return [(f"frame {index}", image) for index, image in enumerate(content)]
    return []


def _image(content: dict[str, Any], place: str) -> Image:
    key = next(key for key in PEOPLE if key in content)
    people = content[key]
    if not isinstance(people, list):
        raise ValueError(f"{place}: {key}: expected a list, got {type(people).__name__}")
    return Image(place, read_people(people, _person, f"{place}: {key}"), size_of(content, place))


def _person(person: Any, place: str) -> Person:
    key = next((key for key in BODY if isinstance(person, dict) and key in person), None)
    if key is None:
        raise ValueError(f"{place}: expected pose_keypoints_2d, got none")
    names, body = _body(person[key], f"{place}: {key}")
    parts = [body]
    for fields in HANDS:
        field, given = next(((name, person[name]) for name in fields if person.get(name)), (fields[0], None))
        parts.append(np.zeros((21, 3)) if given is None else numbers(given, 21, 3, f"{place}: {field}"))
    read = (*BODY, *(name for fields in HANDS for name in fields))
    unused = tuple(name for name in person if "keypoints" in name and name not in read and person[name])
    whole = np.concatenate(parts)
    of_pixels = bool((abs(whole[:, :2]) > RELATIVE).any())  # 0, 0 is the middle of an image from -1 to 1
    points, notes = mark_not_found(whole, NOWHERE if of_pixels else NOWHERE[1:])
    points = check_scores(points, place)
    return Person((*names, *NAMES[25:]), points, track=track_of(person.get("person_id")), notes=notes, unused=unused)


def _body(given: Any, place: str) -> tuple[Layout, Array]:
    """The points of a body and their names, by their number."""
    points = array(given, place)
    count = points.size // 3
    if count not in LAYOUTS or points.shape not in ((count * 3,), (count, 3)):
        got = "none" if points.size == 0 else f"{points.size / 3:g}"
        raise ValueError(f"{place}: expected {expected_counts(LAYOUTS)} points of 3 numbers, got {got}")
    return LAYOUTS[count][1], finite_points(points.reshape(count, 3), place)


OPENPOSE = KeypointFormat(NAMES, matches, images, pixels=partial(relative_to_pixels, shares=shares))
