"""What a format of keypoint files is: how its files are told and read, and how its points become pixels."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from ipman_rs.files import read_json

from ..plausibility import RELATIVE
from .layouts import Layout
from .people import Array, Image

Sizes = Sequence[tuple[float, float] | None]
Pixels = tuple[list[Array], list[str]]  # the points (K, 3) of each person, and notes


def relative_to_pixels(
    people: Sequence[Array],
    sizes: Sizes,
    source: str,
    shares: Callable[[Array], tuple[Array, str]] = lambda points: (points, "0 to 1"),
) -> Pixels:
    """Points (K, 3) of people in pixels, scaled where they look relative to the image, as some programs write them.

    sizes: of each person's image. shares: of relative points (K, 3) those as shares of the image, 0 to 1, and between
    which numbers they were.

    Raises:
        ValueError: points are relative to an image whose size is not known.
    """
    everyone = np.concatenate(people)
    if not _is_relative(everyone):
        return list(people), []
    seen = everyone[everyone[:, 2] > 0, :2]
    look = f"points of {seen.min():.3g} to {seen.max():.3g} look relative to the image"
    if None in sizes:
        raise ValueError(f"{source}: image_size: {look} and need it, got none")
    of, between = shares(everyone)
    each = np.split(of, np.cumsum([len(points) for points in people])[:-1])
    scaled = [points * np.array([*(size or ()), 1.0]) for points, size in zip(each, sizes, strict=True)]
    first = sizes[0] or (0, 0)
    return scaled, [f"{look}: taken as {between} of its {first[0]:g} × {first[1]:g} pixels"]


def _is_relative(points: Array) -> bool:
    """Whether the x and y of points (K, 3) are shares of the image's width and height."""
    seen = points[points[:, 2] > 0.5] if (points[:, 2] > 0.5).any() else points[points[:, 2] > 0]
    return bool((abs(seen[:, :2]) <= RELATIVE).all() and np.ptp(seen[:, :2]) > 0)


@dataclass(frozen=True)
class KeypointFormat:
    """A format of keypoint files. A new one is a file with one of these, and one line in `FORMATS` of the package."""

    names: Layout  # the points of a person that the format knows
    matches: Callable[[Any], bool]  # whether what `load` gives is in this format; does not raise
    images: Callable[[Any, str], list[Image]]  # the people in it, image by image; the str names the file for errors
    suffixes: tuple[str, ...] = (".json",)  # how the files' names end, in lower case
    load: Callable[[Path], Any] = read_json  # the content of a file; ValueError naming the file
    pixels: Callable[[Sequence[Array], Sizes, str], Pixels] = relative_to_pixels  # as that function
