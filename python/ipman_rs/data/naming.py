"""Names of frames, sequences and people, from the paths of images."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

SUFFIXES = (".jpg", ".jpeg", ".png")


def stem(image: str) -> str:
    """The path without its suffix: `images/im0001.jpg` is `images/im0001`."""
    lowered = image.lower()
    return next((image[: -len(suffix)] for suffix in SUFFIXES if lowered.endswith(suffix)), image)


def occurrence(images: NDArray[np.str_], _sequences: NDArray[np.str_]) -> NDArray[np.int64]:
    """How many rows before each row are of the same image: its person's number in the image."""
    order = np.argsort(images, kind="stable")
    rows = np.arange(len(images))
    first = np.append(True, images[order][1:] != images[order][:-1])[: len(rows)]
    number = np.empty(len(rows), np.int64)
    number[order] = rows - np.maximum.accumulate(np.where(first, rows, 0))
    return number


def person(images: NDArray[np.str_], sequences: NDArray[np.str_]) -> NDArray[np.int64]:
    """The person's number in the sequence, where a file lists people one after the other, each in the order of time.

    A new person begins where the images of a sequence go back.
    """
    if not len(images):
        return np.zeros(0, np.int64)
    same = sequences[1:] == sequences[:-1]
    begun = np.append(0, np.cumsum(same & (images[1:] <= images[:-1])))
    return begun - np.maximum.accumulate(np.where(np.append(True, ~same), begun, 0))


def numbered(names: Sequence[str] | NDArray[np.str_], people: NDArray[np.int64]) -> NDArray[np.str_]:
    """The names, with `#1`, `#2` … behind those of the second, third … person."""
    pairs = zip(names, people, strict=True)
    return np.array([name if number == 0 else f"{name}#{number}" for name, number in pairs], dtype=np.str_)


def frame_rate(labels: Sequence[tuple[str, str]], rate: float | None) -> float | None:
    """Hz of rows (name, sequence) whose names end in the image's number: the video's over the step from row to row."""
    numbers = [int("0" + name[len(name.rstrip("0123456789")) :]) for name, _ in labels]
    steps = [
        number - before
        for number, before, (_, sequence), (_, last) in zip(numbers[1:], numbers, labels[1:], labels, strict=False)
        if sequence == last and number > before
    ]
    return rate / min(steps) if rate is not None and steps else None
