"""Files of 2D keypoints, one format a file. A new one is a file with NAMES, `matches` and `images`, and one line here.

detections = keypoints.read("person.json")       # what format it is, its content says
"""

from __future__ import annotations

import os
from collections.abc import Sequence
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np

from ipman_rs.files import read_json

from ..judge import RELATIVE
from . import coco, coco_wholebody, mediapipe, mmpose, openpose
from .detections import Array, Detections
from .layouts import Layout
from .people import Image, Person, choose, confidences, presence, width_height

FORMATS: dict[str, ModuleType] = {
    "openpose": openpose,
    "mmpose": mmpose,
    "coco-wholebody": coco_wholebody,
    "coco": coco,
    "mediapipe": mediapipe,
}

__all__ = ["FORMATS", "read"]

Row = tuple[Image, Person]


def read(
    path: str | os.PathLike[str],
    *,
    format: str | None = None,
    person: int | None = None,
    image_size: tuple[float, float] | None = None,
) -> Detections:
    """The keypoints of one file: a row an image, one person each.

    `person`: its number in each image, or its track where the file follows people over images; else the largest and
    most confident, with a note. `image_size`: width and height in pixels, where the file does not say. Notes tell of
    everything that was left out, assumed or scaled. ValueError, naming the file and the place in it, for a missing or
    corrupt file, an unknown format, wrong counts, what is no finite number, nobody found, and nothing seen of a person.
    """
    source = str(path)
    given = None if image_size is None else width_height(image_size, source)
    content = _load(Path(path))
    reader = _reader(content, format, source)
    images: list[Image] = reader.images(content, source)
    notes = confidences(images)
    rows, told = _rows(images, person, source)
    sizes, other = _sizes([image for image, _ in rows], given, source)
    points, scaled = _pixels([one.points for _, one in rows], sizes, reader, source)
    worlds = [one.world for _, one in rows if one.world is not None]
    if worlds and len(worlds) < len(rows):
        notes.append(f"not used: world landmarks, which {len(rows) - len(worlds)} of {len(rows)} images lack")
        worlds = []
    names = tuple(dict.fromkeys(name for _, one in rows for name in one.names if name is not None))
    layouts = [one.names for _, one in rows]
    flat, deep = _named(points, layouts, names), _named(worlds, layouts, names) if worlds else None
    notes += other + scaled + _assumed(images)
    return Detections(
        names,
        flat[..., :2],
        flat[..., 2],
        tuple(image.source for image, _ in rows),
        None if None in sizes else np.array(sizes, float),
        None if deep is None else deep[..., :3],
        None if deep is None else deep[..., 3],
        (*told, *(f"{source}: {note}" for note in notes)),
    )


def _load(path: Path) -> Any:
    return read_json(path)


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
    got = f"an object with {', '.join(content)[:80] or 'nothing'}" if isinstance(content, dict) else "another content"
    raise ValueError(f"{source}: expected keypoints in one of the formats {', '.join(FORMATS)}, got {got}")


def _rows(images: Sequence[Image], person: int | None, source: str) -> tuple[list[Row], list[str]]:
    """The person of each image, and notes on who else is there. ValueError where no image has one.

    Images without a person are left out of a file of several.
    """
    tracks = _tracks(images)
    if tracks:
        return _tracked(images, tracks, person, source)
    rows: list[Row] = []
    notes: list[str] = []
    faults: list[str] = []
    for image in images:
        try:
            one, note = choose(image, person)
        except ValueError as error:
            faults.append(str(error))
            continue
        rows.append((image, one))
        notes += [] if note is None else [note]
    if not rows:
        raise ValueError(faults[0])
    if faults:
        first = faults[0].removeprefix(f"{source}: ")
        notes.append(f"{source}: {len(faults)} of {len(images)} images left out; first of all: {first}")
    return rows, notes


def _tracks(images: Sequence[Image]) -> dict[int | str, float]:
    """How much of each track is to be seen, where a file of several images tells who is who in all of them."""
    found: dict[int | str, float] = {}
    for image in images:
        tracks = [one.track for one in image.usable.values()]
        if None in tracks or len(set(tracks)) < len(tracks):
            return {}
        for one in image.usable.values():
            assert one.track is not None
            found[one.track] = found.get(one.track, 0.0) + presence(one.points)
    return found if len(images) > 1 and len(found) > 1 else {}


def _tracked(
    images: Sequence[Image], tracks: dict[int | str, float], person: int | None, source: str
) -> tuple[list[Row], list[str]]:
    """The same person in each image."""
    if person is not None and person not in tracks:
        known = ", ".join(str(track) for track in tracks)
        raise ValueError(f"person: expected one of the tracks {known[:80]} of {source}, got {person}")
    track = max(tracks, key=lambda each: tracks[each]) if person is None else person
    rows = [
        (image, one)
        for image in images
        for one in image.usable.values()
        if one.track == track and (one.points[:, 2] > 0).any()
    ]
    if not rows:
        raise ValueError(f"{source}: expected a point with confidence above 0 in track {track}, all have 0")
    said = f"took number {track}, in {len(rows)} of {len(images)} images"
    return rows, [f"{source}: {len(tracks)} people followed over time; {said}"]


def _sizes(
    images: Sequence[Image], given: tuple[float, float] | None, source: str
) -> tuple[list[tuple[float, float] | None], list[str]]:
    """The images' sizes, the given one before the file's own, and a note where these differ."""
    known = {image.size for image in images if image.size is not None}
    if given is None:
        if known and any(image.size is None for image in images):
            raise ValueError(f"{source}: some images have a width and height and others have none; give image_size")
        return [image.size for image in images], []
    said = " and ".join(f"{width:g} × {height:g}" for width, height in sorted(known - {given})[:3])
    other = f"the file says that its image has {said} pixels; {given[0]:g} × {given[1]:g} were given"
    return [given] * len(images), [other] if said else []


def _pixels(
    people: Sequence[Array], sizes: Sequence[tuple[float, float] | None], reader: ModuleType, source: str
) -> tuple[list[Array], list[str]]:
    """Points (K, 3) in pixels, scaled where they are relative to the image. ValueError where its size is not known."""
    everyone = np.concatenate(people)
    if not _is_relative(everyone):
        return list(people), []
    seen = everyone[everyone[:, 2] > 0, :2]
    look = f"points of {seen.min():.3g} to {seen.max():.3g} look relative to the image"
    if None in sizes:
        raise ValueError(f"{source}: image_size: {look} and need it, got none")
    of, between = reader.shares(everyone) if reader is openpose else (everyone, "0 to 1")
    each = np.split(of, np.cumsum([len(points) for points in people])[:-1])
    scaled = [points * np.array([*(size or ()), 1.0]) for points, size in zip(each, sizes, strict=True)]
    if reader is mediapipe:
        return scaled, []
    first = sizes[0] or (0, 0)
    return scaled, [f"{look}: taken as {between} of its {first[0]:g} × {first[1]:g} pixels"]


def _is_relative(points: Array) -> bool:
    """Whether the x and y of points (K, 3) are shares of the image's width and height."""
    seen = points[points[:, 2] > 0.5] if (points[:, 2] > 0.5).any() else points[points[:, 2] > 0]
    return bool((abs(seen[:, :2]) <= RELATIVE).all() and np.ptp(seen[:, :2]) > 0)


def _assumed(images: Sequence[Image]) -> list[str]:
    """What the readers assumed, and what they left out of the file, each once."""
    everyone = [one for image in images for one in image.usable.values()]
    unused = dict.fromkeys(name for one in everyone for name in one.unused)
    notes = list(dict.fromkeys(note for one in everyone for note in one.notes))
    return notes + ([f"not used: {', '.join(unused)}"] if unused else [])


def _named(people: Sequence[Array], layouts: Sequence[Layout], wanted: Sequence[str]) -> Array:
    """The points of each person under the names that are wanted, zeros where there is none."""
    found = np.zeros((len(people), len(wanted), people[0].shape[1]))
    place = {name: column for column, name in enumerate(wanted)}
    for row, (points, names) in enumerate(zip(people, layouts, strict=True)):
        for name, point in zip(names, points, strict=True):
            if name is not None:
                found[row, place[name]] = point
    return found
