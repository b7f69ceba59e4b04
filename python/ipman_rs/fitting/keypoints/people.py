"""What the readers of keypoint files share: people in images, and numbers that are checked one by one."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


@dataclass
class Image:
    """The people found in one image: for each an array (K, 3) of x, y in pixels and confidence."""

    source: str
    people: list[Array]
    size: tuple[float, float] | None = None
    world: Array | None = None  # (K, 4) of the only person: x, y, z in metres and confidence


def numbers(value: Any, rows: int, columns: int, place: str) -> Array:
    """`value`, flat or nested, as an array (rows, columns). ValueError, naming the place, for anything else."""
    try:
        array = np.array(value, dtype=np.float64)
    except (TypeError, ValueError):
        raise ValueError(f"{place}: expected {rows * columns} numbers, got something else among them") from None
    if array.shape not in ((rows * columns,), (rows, columns)):
        raise ValueError(f"{place}: expected {rows} points of {columns} numbers, got shape {array.shape}")
    array = array.reshape(rows, columns)
    if not np.isfinite(array).all():
        row, column = np.argwhere(~np.isfinite(array))[0]
        raise ValueError(f"{place}: point {row}: expected finite numbers, got {array[row, column]}")
    return array


def confident(points: Array, place: str) -> Array:
    """Points (K, 3) with a confidence of 0 to 1. Scores of some detectors exceed 1 a little: they are cut off."""
    if points[:, 2].min() < -0.5 or points[:, 2].max() > 2:
        raise ValueError(
            f"{place}: expected confidences of 0 to 1, got {points[:, 2].min():g} to {points[:, 2].max():g}"
        )
    points[:, 2] = points[:, 2].clip(0, 1)
    return points


def choose(people: Sequence[Array], person: int | None, place: str) -> tuple[Array, str | None]:
    """The person asked for, or else the largest and most confident, and a note if there were others.

    ValueError if there is nobody, or nobody of that number, or if no point of the person was seen.
    """
    if not people:
        raise ValueError(f"{place}: expected a person, got none")
    if person is not None and not 0 <= person < len(people):
        raise ValueError(f"person: expected 0 to {len(people) - 1} in {place}, got {person}")
    index = int(np.argmax([_presence(points) for points in people])) if person is None else person
    if not (people[index][:, 2] > 0).any():
        raise ValueError(f"{place}: person {index}: expected a point with confidence above 0, all have 0")
    if person is not None or len(people) == 1:
        return people[index], None
    return people[index], f"{place}: {len(people)} people; took number {index}, the largest and most confident"


def _presence(points: Array) -> float:
    """How large a person is in the image, times how surely they were seen."""
    seen = points[points[:, 2] > 0]
    if len(seen) == 0:
        return 0.0
    return float(np.linalg.norm(np.ptp(seen[:, :2], axis=0)) * points[:, 2].mean())
