"""The inputs of `ipman fit`: files, and folders of files, as items that are fitted each on its own."""

from __future__ import annotations

import hashlib
import os
from collections.abc import Iterable
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from ... import spellings
from ...data.keypoints import suffixes
from ...files import regular_file, safe_names
from ...files.errors import FileError
from ...files.image import focal_length

if TYPE_CHECKING:
    from ...data.keypoints.detections import Detections

IMAGES = (".png", ".jpg", ".jpeg")
KEYPOINTS = suffixes()
MARKERS = (".trc", ".c3d")
ENDINGS = (*KEYPOINTS, *IMAGES, *MARKERS)


@dataclass
class Item:
    """One person to fit. `failure` says why there is no body; `photo` is what the report shows under it."""

    name: str
    path: Path
    source: str
    detections: Detections | None = None  # of one row; of a photo only after `detect`
    photo: Path | None = None
    notes: list[str] = field(default_factory=list)
    flags: list[str] = field(default_factory=list)
    failure: str | None = None
    focal: float | None = None  # pixels, where the photo's camera wrote it


@dataclass(frozen=True)
class InputOptions:
    """How inputs are read. photo: the image of a keypoint file, drawn under its body. image_size: its width and height
    in pixels or "1920x1080", where the file does not say; ValueError for what is none."""

    person: int | None = None
    image_size: spellings.Spelled | None = None
    photo: Path | None = None
    sequence: bool = False  # the images of a file are frames of one person
    force: bool = False  # keypoints that cannot be a person's are fitted, too
    everyone: bool = False  # of an image, not one person alone; they share its camera's pitch

    def __post_init__(self) -> None:
        if self.everyone and (self.person is not None or self.sequence):
            raise ValueError("`people='all'` goes neither with `person`, which names one, nor with `sequence`")
        spellings.read_fields(self, image_size=spellings.image_size)


def expand(inputs: Iterable[Path]) -> list[Path]:
    """The files, and those in the folders, by name. Raises FileError for a folder without any."""
    files: list[Path] = []
    for path in inputs:
        if not os.path.isdir(path):
            files.append(path)
            continue
        inside = sorted(entry for entry in path.iterdir() if entry.suffix.lower() in ENDINGS and entry.is_file())
        if not inside:
            raise FileError(path, f"no input in this folder; expected files ending in {' '.join(ENDINGS)}")
        files += inside
    return files


def expand_all(inputs: Iterable[Path]) -> tuple[list[Path], list[tuple[str, str]]]:
    """`expand` of each, and (folder, reason) of folders without any."""
    files: list[Path] = []
    failures: list[tuple[str, str]] = []
    for path in inputs:
        try:
            files += expand([path])
        except FileError as error:
            failures.append((str(path), error.what))
    return files, failures


def is_markers(path: Path) -> bool:
    """Whether a file, by its name, holds markers."""
    return path.suffix.lower() in MARKERS


def read_all(paths: Iterable[Path], options: InputOptions) -> tuple[list[Item], list[tuple[str, str]]]:
    """The people in photos and keypoint files, under names of their own; and (input, reason) of the others."""
    items: list[Item] = []
    failures: list[tuple[str, str]] = []
    for path in paths:
        try:
            items += read_items(path, options)
        except FileError as error:
            failures.append((str(path), error.what))
        except (OSError, ValueError) as error:
            failures.append((str(path), str(error)))
    for item, name in zip(items, safe_names([item.name for item in items]), strict=True):
        item.name = name
    return items, failures


def read_items(path: Path, options: InputOptions) -> list[Item]:
    """The people of one file: one per image. Those of a photo are detected later. Raises FileError."""
    kind = path.suffix.lower()
    try:
        regular_file(path)
    except ValueError as error:
        raise FileError(path, str(error)) from None
    if kind in IMAGES:
        return [Item(path.stem, path, str(path), photo=path)]
    if kind not in KEYPOINTS:
        raise FileError(path, f"unknown kind {kind or 'without ending'!r}; expected {' '.join(ENDINGS)}")
    from ...data import keypoints

    try:
        size, odd = _size(options)
        detections = keypoints.read(path, person=options.person, image_size=size, everyone=options.everyone)
    except ValueError as error:
        raise FileError(path, _advice(str(error))) from error
    if detections.image_size is None:
        raise FileError(path, "does not say how large its image is; give `image_size=WIDTHxHEIGHT` or `photo=PHOTO`")
    people, notes = _admitted(path, [_row(detections, row) for row in range(len(detections))], options.force)
    many, images = len(detections) > 1, len(set(detections.sources))
    if images > 1 and not options.sequence:
        notes.append(f"{path}: {images} images, each fitted on its own; `sequence` fits one person over time")
    items = [
        Item(
            f"{path.stem}_{number}" if many else path.stem,
            path,
            one.sources[0],
            one,
            options.photo,
            list(one.notes),
            list(flags),
        )
        for number, (one, flags) in enumerate(people)
    ]
    items[0].notes += notes + odd
    return items


def _admitted(
    path: Path, people: list[Detections], force: bool
) -> tuple[list[tuple[Detections, tuple[str, ...]]], list[str]]:
    """The people whose points can be a person in the image, each with its flags, and notes of those left out.

    Raises FileError where nobody's can.
    """
    from ...data import plausibility

    admitted: list[tuple[Detections, tuple[str, ...]]] = []
    notes: list[str] = []
    refused: list[str] = []
    for one in people:
        assert one.image_size is not None
        points = np.column_stack([one.points[0], one.confidence[0]])
        try:
            odd = plausibility.admit(one.sources[0], plausibility.keypoints(points, one.image_size[0]), force)
        except plausibility.NoPerson as error:
            refused.append(str(error))
            continue
        admitted.append((one, odd))
    if not admitted:
        raise FileError(path, refused[0])
    if refused:
        first = refused[0].removeprefix(f"{path}: ")
        notes.append(f"{path}: {len(refused)} of {len(people)} images refused; first of all: {first}")
    return admitted, notes


def detect(item: Item) -> None:
    """Detect the person in an item's photo. Raises FileError."""
    from .. import photo

    try:
        item.detections = photo.detect([item.path])
    except (ValueError, ImportError) as error:
        raise FileError(item.path, str(error)) from error
    item.notes += item.detections.notes
    item.focal = focal_length(item.path)
    if item.focal is not None:
        item.notes.append(f"focal length: {item.focal:.0f} px, as the camera wrote it into the photo")


def detect_everyone(item: Item) -> list[Item]:
    """An item for each person in an item's photo. Raises FileError."""
    from .. import photo

    try:
        people = photo.detect_everyone(item.path)
        focal = focal_length(item.path)
    except (ValueError, ImportError) as error:
        raise FileError(item.path, str(error)) from error
    rows = [_row(people, row) for row in range(len(people))]
    found = f"{item.path}: {len(rows)} people found; MediaPipe finds one at a time, and some may be missing"
    item.notes.append(found)
    return [
        replace(item, name=f"{item.name}_{n}", detections=one, focal=focal, notes=[*item.notes], flags=[])
        for n, one in enumerate(rows)
    ]


def _size(options: InputOptions) -> tuple[tuple[float, float] | None, list[str]]:
    """The image's size as given, or the photo's, and a note where the two differ."""
    if options.photo is None:
        return options.image_size, []
    from .. import photo

    height, width = photo.read(options.photo).shape[:2]
    size, given = (float(width), float(height)), options.image_size
    if given is None or given == size:
        return size, []
    said = f"{options.photo}: the photo has {width} × {height} pixels, `image_size` says {given[0]:g} × {given[1]:g}"
    return given, [said]


def _advice(what: str) -> str:
    if "image_size" in what and "need it" in what:
        return f"{what}; give `image_size=WIDTHxHEIGHT` or `photo=PHOTO`"
    return what


def _row(detections: Detections, row: int) -> Detections:
    """One row of detections, with the notes that are its own."""
    from ...data.keypoints.detections import Detections

    def part(value: np.ndarray | None) -> np.ndarray | None:
        return None if value is None else value[row : row + 1]

    points, confidence = detections.points[row : row + 1], detections.confidence[row : row + 1]
    others = (part(detections.image_size), part(detections.points_3d), part(detections.confidence_3d))
    others_notes = tuple(f"{source}:" for source in detections.sources if source != detections.sources[row])
    own = f"{detections.sources[row]}:"
    notes = tuple(  # what is said of the whole file goes to its first image
        note for note in detections.notes if note.startswith(own) or (row == 0 and not note.startswith(others_notes))
    )
    return Detections(detections.names, points, confidence, (detections.sources[row],), *others, notes)


def identity(item: Item, options: str) -> str:
    """What a fit depends on, as a hash: the input's bytes, which person of it, and all options."""
    digest = hashlib.sha256()
    for part in (options.encode(), item.name.encode(), _bytes(item.path), _bytes(item.photo)):
        digest.update(hashlib.sha256(part).digest())
    return digest.hexdigest()


def _bytes(path: Path | None) -> bytes:
    return b"" if path is None else regular_file(path).read_bytes()
