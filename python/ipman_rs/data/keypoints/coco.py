"""COCO's JSON, and what detectors write in its manner: an annotation file, a list of results, or a single person.

{"images": [{"id", "file_name", "width", "height"}, ...], "annotations": [{"image_id", "keypoints": [x, y, v, ...]}]}
[{"image_id", "keypoints": [x, y, score, ...]}, ...]        {"keypoints": [[x, y], ...], "keypoint_scores": [...]}

The points are COCO's 17, Halpe's 26 or 136 (AlphaPose), COCO-WholeBody's 133, or MediaPipe's 33 (TensorFlow.js); their
number says which. They may be {"x", "y", "score"} each, or {"x": [...], "y": [...], "visible": [...]} together (YOLO).
Every image with labelled people becomes a row. People without an image_id are taken to be in the same image.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from . import layouts
from .keypoint_format import KeypointFormat
from .layouts import COCO_17, Layout
from .people import (
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
    short_label,
    size_of,
    track_of,
)

NAMES = COCO_17

LAYOUTS: dict[int, tuple[str, Layout]] = {
    17: ("COCO", NAMES),
    26: ("Halpe", layouts.HALPE_26),
    33: ("MediaPipe", layouts.MEDIAPIPE_33),
    133: ("COCO-WholeBody", layouts.COCO_WHOLEBODY_133),
    136: ("Halpe", layouts.HALPE_136),
}
PARTS = {"foot_kpts": 6, "face_kpts": 68, "lefthand_kpts": 21, "righthand_kpts": 21}  # of COCO-WholeBody, beside 17
SCORES = ("keypoint_scores", "keypoints_scores", "scores", "keypoints_visible")
SCORE = ("score", "confidence", "visibility", "visible")  # of a point that is an object
TRACKS = ("track_id", "tracking_id", "idx")
ELSE = ("keypoints3D", "keypoints_3d", "face_keypoints", "face_kpts", "face_keypoints_2d", "keypoints3d")
FACE = "68 points of the face"


def matches(content: Any) -> bool:
    return entries(content) is not None


def images(content: Any, source: str) -> list[Image]:
    """People sorted into their images."""
    described = _image_records(content, source)
    grouped: dict[Any, list[tuple[int, Any]]] = {}
    for index, entry in enumerate(entries(content) or []):
        if entry.get("num_keypoints") == 0:  # COCO lists people without keypoints, too
            continue
        identity = entry.get("image_id")
        if identity is not None and not isinstance(identity, (int, float, str)):
            raise ValueError(
                f"{source}: annotations[{index}]: image_id: expected a number or a name, got {short_label(identity)}"
            )
        grouped.setdefault(identity, []).append((index, entry))
    pictures = []
    for identity, people in grouped.items():
        about = described.get(identity, {})
        label = about.get("file_name", identity)
        place = source if label is None else f"{source}: {short_label(label)}"
        persons = [
            read_people([entry], lambda entry, _, index=index: person(entry, f"{source}: annotations[{index}]"), source)
            for index, entry in people
        ]
        pictures.append(Image(place, [one for (one,) in persons], size_of(about, place)))
    return pictures or [Image(source, [])]


def entries(content: Any) -> list[Any] | None:
    """The people of a file in COCO's form, None if it is none."""
    if isinstance(content, dict) and "annotations" in content:
        content = content["annotations"]
        if not content:
            return [] if isinstance(content, list) else None
    elif isinstance(content, dict) and "keypoints" in content:
        content = [content]
    if not isinstance(content, list) or not all(isinstance(entry, dict) for entry in content):
        return None
    return content if any("keypoints" in entry for entry in content) else None


def _image_records(content: Any, source: str) -> dict[Any, dict[str, Any]]:
    """What an annotation file says about its images, by their ids. ValueError if its points are not a body's."""
    if not isinstance(content, dict):
        return {}
    categories, listed = content.get("categories"), content.get("images")
    for category in categories if isinstance(categories, list) else []:
        if isinstance(category, dict) and isinstance(category.get("keypoints"), list):
            check_first_name(category["keypoints"], f"{source}: categories")
    records = [image for image in listed if isinstance(image, dict)] if isinstance(listed, list) else []
    return {image["id"]: image for image in records if isinstance(image.get("id"), (int, float, str))}


def check_first_name(names: Sequence[Any], place: str) -> None:
    """ValueError if a file says of its points that the first is no nose: then the order is none of `LAYOUTS`."""
    if names and short_label(names[0]).lower() != "nose":
        names_found = ", ".join(short_label(name) for name in names[:3])
        raise ValueError(f"{place}: expected {expected_counts(LAYOUTS)} points from the nose on, got {names_found}, …")


def person(entry: Any, place: str) -> Person:
    """A person's points and scores, or COCO's flags (0 not labelled, 1 hidden, 2 visible). ValueError."""
    if not isinstance(entry, dict) or "keypoints" not in entry:
        raise ValueError(f"{place}: expected keypoints, got none")
    if "foot_kpts" in entry:
        points, notes = _parts(entry, place), ()
    else:
        points, notes = _points(entry, f"{place}: keypoints")
    names = LAYOUTS[len(points)][1]
    points, nowhere = mark_not_found(points)
    notes = (*notes, *nowhere)
    unused = [key for key in ELSE if entry.get(key) and not (key in PARTS and "foot_kpts" in entry)]
    unused += [FACE] if len(points) in (133, 136) else []
    track = next((track_of(entry[key]) for key in TRACKS if key in entry), None)
    return Person(names, check_scores(points, place), track=track, notes=notes, unused=tuple(unused))


def _parts(entry: dict[str, Any], place: str) -> Array:
    """COCO-WholeBody's points, whose face and hands may be missing."""
    body = [_flags(numbers(entry["keypoints"], len(NAMES), 3, f"{place}: keypoints"))]
    for field, count in PARTS.items():
        values = entry.get(field)
        points = numbers(values, count, 3, f"{place}: {field}") if values else np.zeros((count, 3))
        body.append(_flags(points))
    return np.concatenate(body)


def _points(entry: dict[str, Any], place: str) -> tuple[Array, tuple[str, ...]]:
    """The points (K, 3) of one of the known layouts, and what was assumed of them."""
    values, scores = entry["keypoints"], next((entry[key] for key in SCORES if isinstance(entry.get(key), list)), None)
    if isinstance(values, list) and values and all(isinstance(point, dict) for point in values):
        values, scores = _of_objects(values, scores, place)
    elif isinstance(values, dict) and "x" in values and "y" in values:
        scores = next((values[key] for key in ("visible", "confidence", "score") if key in values), scores)
        values = _columns(values, place)
    points = array(values, place)
    if points.ndim == 1:
        points = _rows(points, 3 if scores is None else 2, place)
    if points.ndim != 2 or len(points) not in LAYOUTS or points.shape[1] not in (2, 3):
        raise ValueError(f"{place}: expected {expected_counts(LAYOUTS)} points of x, y and score, got {_count(points)}")
    if points.shape[1] == 3:
        if scores is not None:
            raise ValueError(f"{place}: expected x and y beside keypoint_scores, got x, y and z: these are 3D points")
        return _flags(finite_points(points, place)), ()
    if scores is None:
        return np.column_stack([finite_points(points, place), np.ones(len(points))]), (
            "no scores: all points taken as seen",
        )
    confidence = array(scores, f"{place}: scores").reshape(-1)
    if len(confidence) != len(points):
        raise ValueError(f"{place}: scores: expected {len(points)} numbers, got {len(confidence)}")
    return finite_points(np.column_stack([points, np.nan_to_num(confidence, nan=0.0)]), place), ()


def _rows(flat: Array, columns: int, place: str) -> Array:
    """A flat list as points."""
    if len(flat) == 0 or len(flat) % columns:
        raise ValueError(
            f"{place}: expected {expected_counts(LAYOUTS)} points of {columns} numbers, got {len(flat)} numbers"
        )
    return flat.reshape(-1, columns)


def _of_objects(points_listed: list[Any], scores: Any, place: str) -> tuple[Any, Any]:
    """Points and scores out of [{"x", "y", "score"}, ...]."""
    if not all("x" in point and "y" in point for point in points_listed):
        raise ValueError(f"{place}: expected x and y of every point")
    key = next((key for key in SCORE if all(key in point for point in points_listed)), None)
    points = [[point["x"], point["y"]] for point in points_listed]
    return points, scores if key is None else [point[key] for point in points_listed]


def _columns(axes: dict[str, Any], place: str) -> Array:
    x, y = (array(axes[axis], f"{place}: {axis}").reshape(-1) for axis in ("x", "y"))
    if len(x) != len(y):
        raise ValueError(f"{place}: expected as many x as y, got {len(x)} and {len(y)}")
    return np.column_stack([x, y])


def _flags(points: Array) -> Array:
    """Points with COCO's flags as scores; a label of 0, 1 or 2 is no measure of confidence."""
    if np.isin(points[~np.isnan(points[:, 2]), 2], (0, 1, 2)).all():
        points[:, 2] = points[:, 2].clip(0, 1)
    return points


def _count(points: Array) -> str:
    return f"{len(points)} of {points.shape[1]} numbers" if points.ndim == 2 else f"shape {points.shape}"


COCO = KeypointFormat(NAMES, matches, images)
