"""Files of 2D keypoints, one format a file. A new one is a file with a `KeypointFormat`, and one line here.

detections = keypoints.read("person.json")       # what format it is, its content says
"""

from __future__ import annotations

import os
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from .coco import COCO
from .coco_wholebody import COCO_WHOLEBODY
from .detections import Array, Detections
from .keypoint_format import KeypointFormat
from .layouts import Layout
from .mediapipe import MEDIAPIPE
from .mmpose import MMPOSE
from .openpose import OPENPOSE
from .people import Image, Person, choose, confidences, presence, width_height

FORMATS: dict[str, KeypointFormat] = {
    "openpose": OPENPOSE,
    "mmpose": MMPOSE,
    "coco-wholebody": COCO_WHOLEBODY,
    "coco": COCO,
    "mediapipe": MEDIAPIPE,
}

__all__ = ["FORMATS", "read", "suffixes"]

Row = tuple[Image, Person]


def suffixes() -> tuple[str, ...]:
    """How the names of keypoint files end: `.json` and those of other formats."""
    return tuple(dict.fromkeys(suffix for format in FORMATS.values() for suffix in format.suffixes))


def read(
    path: str | os.PathLike[str],
    *,
    format: str | None = None,
    person: int | None = None,
    image_size: tuple[float, float] | None = None,
    everyone: bool = False,
) -> Detections:
    """The keypoints of one file: a row an image, one person each.

    `person`: its number in each image, or its track where the file follows people over images; else the largest and
    most confident, with a note. `everyone`: a row for each person of each image instead. `image_size`: width and height
    in pixels, where the file does not say. Notes tell of everything that was left out, assumed or scaled. ValueError,
    naming the file and the place in it, for a missing or corrupt file, an unknown format, wrong counts, what is no
    finite number, nobody found, and nothing seen of a person.
    """
    source = str(path)
    given = None if image_size is None else width_height(image_size, source)
    reader, content = _opened(Path(path), format)
    images = reader.images(content, source)
    notes = confidences(images)
    rows, warnings = _everyone(images) if everyone else _rows(images, person, source)
    sizes, other = _sizes([image for image, _ in rows], given, source)
    points, scaled = reader.pixels([one.points for _, one in rows], sizes, source)
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
        (*warnings, *(f"{source}: {note}" for note in notes)),
    )


def _opened(path: Path, name: str | None) -> tuple[KeypointFormat, Any]:
    """The format asked for, or that which the file's ending and content look like; and the content."""
    if name is not None:
        if name not in FORMATS:
            raise ValueError(f"format: expected one of {', '.join(FORMATS)}, got {name!r}")
        content = FORMATS[name].load(path)
        if not FORMATS[name].matches(content):
            raise ValueError(f"{path}: expected the format {name}, got something else")
        return FORMATS[name], content
    suffix = path.suffix.lower() if path.suffix.lower() in suffixes() else ".json"
    content, loaded_by = None, None
    for format in FORMATS.values():
        if suffix in format.suffixes:
            if format.load is not loaded_by:
                content, loaded_by = format.load(path), format.load
            if format.matches(content):
                return format, content
    got = f"an object with {', '.join(content)[:80] or 'nothing'}" if isinstance(content, dict) else "another content"
    raise ValueError(f"{path}: expected keypoints in one of the formats {', '.join(FORMATS)}, got {got}")


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


def _everyone(images: Sequence[Image]) -> tuple[list[Row], list[str]]:
    """All people of each image of whom something was seen, and notes on those who cannot be used. ValueError where no
    image has one."""
    rows = [(image, one) for image in images for one in image.usable.values() if (one.points[:, 2] > 0).any()]
    if not rows:
        choose(images[0], None)  # says why
    faults = [one for image in images for one in image.people if isinstance(one, str)]
    return rows, [f"cannot be used: {fault}" for fault in faults]


def _tracks(images: Sequence[Image]) -> dict[int | str, float]:
    """How much of each track is to be seen, where a file of several images tells who is who in all of them."""
    presences: dict[int | str, float] = {}
    for image in images:
        tracks = [one.track for one in image.usable.values()]
        if None in tracks or len(set(tracks)) < len(tracks):
            return {}
        for one in image.usable.values():
            assert one.track is not None
            presences[one.track] = presences.get(one.track, 0.0) + presence(one.points)
    return presences if len(images) > 1 and len(presences) > 1 else {}


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
    note = f"took number {track}, in {len(rows)} of {len(images)} images"
    return rows, [f"{source}: {len(tracks)} people followed over time; {note}"]


def _sizes(
    images: Sequence[Image], given: tuple[float, float] | None, source: str
) -> tuple[list[tuple[float, float] | None], list[str]]:
    """The images' sizes, the given one before the file's own, and a note where these differ."""
    known = {image.size for image in images if image.size is not None}
    if given is None:
        if known and any(image.size is None for image in images):
            raise ValueError(f"{source}: some images have a width and height and others have none; give image_size")
        return [image.size for image in images], []
    sizes = " and ".join(f"{width:g} × {height:g}" for width, height in sorted(known - {given})[:3])
    other = f"the file says that its image has {sizes} pixels; {given[0]:g} × {given[1]:g} were given"
    return [given] * len(images), [other] if sizes else []


def _assumed(images: Sequence[Image]) -> list[str]:
    """What the readers assumed, and what they left out of the file, each once."""
    everyone = [one for image in images for one in image.usable.values()]
    unused = dict.fromkeys(name for one in everyone for name in one.unused)
    notes = list(dict.fromkeys(note for one in everyone for note in one.notes))
    return notes + ([f"not used: {', '.join(unused)}"] if unused else [])


def _named(people: Sequence[Array], layouts: Sequence[Layout], wanted: Sequence[str]) -> Array:
    """The points of each person under the names that are wanted, zeros where there is none."""
    values = np.zeros((len(people), len(wanted), people[0].shape[1]))
    place = {name: column for column, name in enumerate(wanted)}
    for row, (points, names) in enumerate(zip(people, layouts, strict=True)):
        for name, point in zip(names, points, strict=True):
            if name is not None:
                values[row, place[name]] = point
    return values
