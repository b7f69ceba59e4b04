"""What the readers of keypoint files share: people in images, and checks of their numbers."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .layouts import Layout

Array = NDArray[np.float64]

SURELY_NO_SCORE = (-0.5, 20.0)  # detectors of the SimCC kind (RTMPose, RTMW) and AlphaPose give scores up to about 10
NOWHERE = (0.0, -1.0)  # x and y of what was not found
CLIPPED = 2.0  # scores of heatmaps exceed 1 a little; a file with larger ones has another scale
SIZES = (
    ("width", "height"),
    ("image_width", "image_height"),
    ("imageWidth", "imageHeight"),
    ("canvas_width", "canvas_height"),
)


@dataclass
class Person:
    """A person's points (K, 3): x, y and the detector's score, in the order of `names`."""

    names: Layout
    points: Array
    world: Array | None = None  # (K, 4): x, y, z in metres and confidence
    track: int | str | None = None  # which person over time, where the file says
    notes: tuple[str, ...] = ()  # what was assumed
    unused: tuple[str, ...] = ()  # entries of the file that are not read


@dataclass
class Image:
    """The people found in one image; in place of an unusable person, the reason."""

    source: str
    people: list[Person | str]
    size: tuple[float, float] | None = None

    @property
    def usable(self) -> dict[int, Person]:
        """The people with points, by their numbers in the image."""
        return {index: each for index, each in enumerate(self.people) if isinstance(each, Person)}


def read_people(entries: Sequence[Any], person: Callable[[Any, str], Person], place: str) -> list[Person | str]:
    """The people of these entries, each read on its own: what is wrong with one says nothing about the others."""
    people: list[Person | str] = []
    for index, entry in enumerate(entries):
        try:
            people.append(person(entry, f"{place}[{index}]"))
        except ValueError as error:
            people.append(str(error))
    return people


def array(value: Any, place: str) -> Array:
    """`value` as numbers, without leading axes of length 1; null is NaN. ValueError, naming the place."""
    try:
        values = np.array(value, dtype=np.float64)
    except (TypeError, ValueError, OverflowError):
        raise ValueError(f"{place}: expected numbers, got something else among them") from None
    while values.ndim > 2 and values.shape[0] == 1:
        values = values[0]
    return values


def numbers(value: Any, rows: int, columns: int, place: str) -> Array:
    """`value`, flat or nested, as an array (rows, columns). ValueError, naming the place, for anything else."""
    values = array(value, place)
    if values.shape not in ((rows * columns,), (rows, columns)):
        raise ValueError(f"{place}: expected {rows} points of {columns} numbers, got {_shape(values)}")
    return finite_points(values.reshape(rows, columns), place)


def _shape(values: Array) -> str:
    return "none" if values.size == 0 else f"shape {values.shape}"


def expected_counts(layouts: Mapping[int, tuple[str, Layout]]) -> str:
    """How many points a person may have, for errors."""
    options = [f"{count} ({name})" for count, (name, _) in layouts.items()]
    return f"{', '.join(options[:-1])} or {options[-1]}"


def finite_points(points: Array, place: str) -> Array:
    """Points (K, C) of finite numbers, or of none at all: without x and y a point is NaN. ValueError for others."""
    missing = np.isnan(points[:, 0]) & np.isnan(points[:, 1])
    wrong = np.argwhere(~np.isfinite(points) & ~missing[:, None])
    if len(wrong):
        row, column = wrong[0]
        raise ValueError(f"{place}: point {row}: expected finite numbers, got {points[row, column]}")
    largest = abs(points[~missing]).max(initial=0)
    if largest > 1e9:
        raise ValueError(f"{place}: expected pixels, got numbers up to {largest:g}")
    points[missing] = np.nan
    return points


def mark_not_found(points: Array, places: Sequence[float] = NOWHERE) -> tuple[Array, tuple[str, ...]]:
    """Points (K, 3), those with the score 0 that lie exactly where programs put what they did not find; and a note of
    each such place."""
    points, notes = points.copy(), []
    for place in places:
        there = (points[:, :2] == place).all(axis=1) & (points[:, 2] > 0)
        if there.any():
            points[there, 2] = 0.0
            notes.append(f"points at {place:g}, {place:g} taken as not seen")
    return points, tuple(notes)


def check_scores(points: Array, place: str) -> Array:
    """Points (K, 3) whose third number can be a score. ValueError for others."""
    scores = points[~np.isnan(points[:, 2]), 2]
    if not len(scores):
        return points
    least, most = scores.min(), scores.max()
    if least < SURELY_NO_SCORE[0] or most > SURELY_NO_SCORE[1]:
        raise ValueError(f"{place}: expected confidences of 0 to 1, got {least:g} to {most:g}")
    return points


def confidences(images: Sequence[Image]) -> list[str]:
    """Bring the scores of a whole file to 0 to 1, 0 for points without numbers, and say what that took."""
    people = [person for image in images for person in image.usable.values()]
    missing = sum(int(np.isnan(person.points[:, 2]).sum()) for person in people)
    notes = [f"{missing} points without numbers taken as not seen"] if missing else []
    for person in people:
        person.points[np.isnan(person.points[:, 2])] = 0.0
    most = max((float(person.points[:, 2].max()) for person in people), default=0.0)
    for person in people:
        person.points[:, 2] = (person.points[:, 2] / (most if most > CLIPPED else 1.0)).clip(0, 1)
    if most > CLIPPED:
        return [*notes, f"scores up to {most:.3g}, not 1: divided by that"]
    return [*notes, f"scores up to {most:.3g} cut off at 1"] if most > 1.005 else notes


def size_of(record: Mapping[str, Any], place: str) -> tuple[float, float] | None:
    """Width and height of an image, where a file has them under one of their usual names. ValueError for no numbers."""
    for pair in SIZES:
        if all(record.get(name) is not None for name in pair):
            return width_height([record[name] for name in pair], place)
    return None


def width_height(value: Any, place: str) -> tuple[float, float]:
    """Two numbers above 0. ValueError, naming the place, for others."""
    width, height = numbers(value, 1, 2, f"{place}: image_size")[0].tolist()
    if not (width > 0 and height > 0):
        raise ValueError(f"{place}: image_size: expected width and height above 0, got {width:g} and {height:g}")
    return width, height


def short_label(value: Any) -> str:
    """What a file says, for labels and errors: lists and objects, which may be deep, only by what they are."""
    return str(value)[:80] if isinstance(value, (str, int, float)) else type(value).__name__


def track_of(value: Any) -> int | str | None:
    """A track's number or name; lists of one and -1, "no track", are what trackers write, too."""
    value = value[0] if isinstance(value, list) and len(value) == 1 else value
    if isinstance(value, float) and value.is_integer():
        value = int(value)
    if isinstance(value, bool) or not isinstance(value, (int, str)):
        return None
    return None if isinstance(value, int) and value < 0 else value


def choose(image: Image, person: int | None) -> tuple[Person, str | None]:
    """The person asked for, or else the largest and most confident, and a note if there were others.

    ValueError if there is nobody, or nobody of that number, or if no point of the person was seen.
    """
    people, place = image.people, image.source
    if not people:
        raise ValueError(f"{place}: expected a person, got none")
    if person is not None and not 0 <= person < len(people):
        raise ValueError(f"person: expected 0 to {len(people) - 1} in {place}, got {person}")
    usable = image.usable if person is None else {person: people[person]}
    visible = {index: one for index, one in usable.items() if isinstance(one, Person) and (one.points[:, 2] > 0).any()}
    if not visible:
        raise ValueError(_nobody(image, person))
    index = max(visible, key=lambda number: presence(visible[number].points))
    if person is not None or len(people) == 1:
        return visible[index], None
    faults = [f"{number} ({_short(one, place)})" for number, one in enumerate(people) if isinstance(one, str)]
    note = f"{place}: {len(people)} people; took number {index}, the largest and most confident"
    return visible[index], note + (f"; cannot be used: {', '.join(faults)}" if faults else "")


def _nobody(image: Image, person: int | None) -> str:
    """Why no one of an image, or not the one asked for, can be taken."""
    asked = range(len(image.people)) if person is None else [person]
    fault = next((image.people[index] for index in asked if isinstance(image.people[index], str)), None)
    if isinstance(fault, str):
        return fault
    return f"{image.source}: person {asked[0]}: expected a point with confidence above 0, all have 0"


def _short(fault: str, place: str) -> str:
    return fault.removeprefix(f"{place}: ")


def presence(points: Array) -> float:
    """How large a person is in the image, times how surely they were seen."""
    visible = points[points[:, 2] > 0]
    if len(visible) == 0:
        return 0.0
    return float(np.linalg.norm(np.ptp(visible[:, :2], axis=0)) * points[:, 2].mean())
