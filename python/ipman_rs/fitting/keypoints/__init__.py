"""Files of 2D keypoints, one format a file. A new one is a file with NAMES, `matches` and `images`, and one line here.

detections = keypoints.read("person.json")       # what format it is, its content says
"""

from __future__ import annotations

import json
import os
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np

from ..detections import Array, Detections
from . import coco, coco_wholebody, mediapipe, openpose
from .people import Image, choose

FORMATS: dict[str, ModuleType] = {
    "openpose": openpose,
    "coco": coco,
    "coco-wholebody": coco_wholebody,
    "mediapipe": mediapipe,
}

__all__ = ["FORMATS", "read"]


def read(
    path: str | os.PathLike[str],
    *,
    format: str | None = None,
    person: int | None = None,
    image_size: tuple[float, float] | None = None,
) -> Detections:
    """The keypoints of one file: a row an image, one person each.

    `person`: its number in the file, else the largest and most confident, with a note. `image_size`: width and height
    in pixels, where the file does not say. ValueError, naming the file and the place in it, for a missing or corrupt
    file, an unknown format, wrong counts, what is no finite number, nobody found, and nothing seen of a person.
    """
    source = str(path)
    content = _load(Path(path))
    reader = _reader(content, format, source)
    images = reader.images(content, source)
    rows = [_row(image, reader, person, image_size) for image in images]
    sizes = [size for _, _, size in rows]
    if None in sizes and any(size is not None for size in sizes):
        raise ValueError(f"{source}: some images have a width and height and others have none; give image_size")
    kept = [index for index, name in enumerate(reader.NAMES) if name is not None]
    points = np.stack([points for points, _, _ in rows])[:, kept]
    world = _world(images, kept)
    return Detections(
        tuple(reader.NAMES[index] for index in kept),
        points[..., :2],
        points[..., 2],
        tuple(image.source for image in images),
        None if None in sizes else np.array(sizes, float),
        None if world is None else world[..., :3],
        None if world is None else world[..., 3],
        tuple(note for _, note, _ in rows if note is not None),
    )


def _load(path: Path) -> Any:
    if not path.is_file():
        raise ValueError(f"{path}: no such file")
    try:
        return json.loads(path.read_text(encoding="utf-8"))
    except UnicodeDecodeError:
        raise ValueError(f"{path}: expected JSON, got a file that is no text") from None
    except (json.JSONDecodeError, RecursionError) as error:
        raise ValueError(f"{path}: expected JSON: {error}") from None


def _reader(content: Any, format: str | None, source: str) -> ModuleType:
    """The format asked for, or the one that the content looks like."""
    if format is not None:
        if format not in FORMATS:
            raise ValueError(f"format: expected one of {', '.join(FORMATS)}, got {format!r}")
        if not FORMATS[format].matches(content):
            raise ValueError(f"{source}: expected the format {format}, got something else")
        return FORMATS[format]
    for reader in FORMATS.values():
        if reader.matches(content):
            return reader
    raise ValueError(f"{source}: expected keypoints in one of the formats {', '.join(FORMATS)}, got another content")


def _row(
    image: Image, reader: ModuleType, person: int | None, given: tuple[float, float] | None
) -> tuple[Array, str | None, tuple[float, float] | None]:
    """The chosen person's points (K, 3) in pixels, a note, and the image's size."""
    points, note = choose(image.people, person, image.source)
    size = given if given is not None else image.size
    if size is not None and not (np.isfinite(size).all() and min(size) > 0):
        raise ValueError(f"{image.source}: image_size: expected width and height above 0, got {size}")
    if reader is mediapipe and mediapipe.is_relative(points):
        if size is None:
            raise ValueError(f"{image.source}: image_size: points relative to the image need it, got none")
        points = points * np.array([*size, 1.0])
    return points, note, size


def _world(images: list[Image], kept: list[int]) -> Array | None:
    worlds = [image.world for image in images if image.world is not None]
    return np.stack(worlds)[:, kept] if len(worlds) == len(images) else None
