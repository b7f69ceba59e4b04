"""MMPose's JSON: the inferencer's predictions and the demos' results, of an image or of a video.

[{"frame_id", "instances": [{"keypoints": [[x, y], ...], "keypoint_scores": [...], "bbox", "bbox_score"}, ...]}, ...]
{"meta_info": {...}, "instance_info": [...]}      {"predictions": [[{"keypoints", ...}, ...], ...]}

A person is read as by `coco`. A list of people without frames is an image's: `coco` reads that.
"""

from __future__ import annotations

from typing import Any

from . import coco
from .keypoint_format import KeypointFormat
from .people import Image, read_people, short_label

NAMES = coco.NAMES
AROUND = ("instance_info", "predictions", "frames")


def matches(content: Any) -> bool:
    return _frames(content) is not None


def images(content: Any, source: str) -> list[Image]:
    if isinstance(content, dict):
        _check_names(content.get("meta_info"), source)
    pictures = []
    for label, people in _frames(content) or []:
        place = source if label is None else f"{source}: frame {short_label(label)}"
        if people is not None and not isinstance(people, list):
            raise ValueError(f"{place}: instances: expected a list, got {type(people).__name__}")
        pictures.append(Image(place, read_people(people or [], coco.person, f"{place}: instances")))
    return pictures or [Image(source, [])]


def _frames(content: Any) -> list[tuple[Any, Any]] | None:
    """The images of a file with their labels, None if it is not in one of these forms."""
    around = False
    for key in AROUND:
        if isinstance(content, dict) and isinstance(content.get(key), list):
            content, around = content[key], True
    if isinstance(content, dict) and "instances" in content:
        return [(None, content["instances"])]
    if not isinstance(content, list):
        return None
    if content and all(isinstance(frame, dict) and "instances" in frame for frame in content):
        return [(frame.get("frame_id", index), frame["instances"]) for index, frame in enumerate(content)]
    if all(isinstance(frame, list) for frame in content) and any(_is_person(p) for frame in content for p in frame[:1]):
        return [(None if len(content) == 1 else index, frame) for index, frame in enumerate(content)]
    return [(None, content)] if around and content and all(_is_person(one) for one in content) else None


def _is_person(entry: Any) -> bool:
    return isinstance(entry, dict) and "keypoints" in entry


def _check_names(meta: Any, source: str) -> None:
    """ValueError if the file says that its points are others than COCO's: 17 may be those of Human3.6M."""
    names = meta.get("keypoint_id2name") if isinstance(meta, dict) else None
    if isinstance(names, dict) and "0" in names:
        coco.check_first_name(list(names.values()), f"{source}: meta_info")


MMPOSE = KeypointFormat(NAMES, matches, images)
