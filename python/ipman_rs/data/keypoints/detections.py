"""Keypoints as detectors report them, under the names of `landmarks`."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Detections:
    """N people, a row each, and K points. Points that were not seen have confidence 0 and any finite coordinates.

    `points_3d` are metres in the camera's directions (x right, y down, z forward) with an origin of their own, as
    MediaPipe's world landmarks. ValueError for wrong shapes, for what is not finite, for confidences outside 0 to 1.
    """

    names: tuple[str, ...]  # K
    points: Array  # (N, K, 2) pixels
    confidence: Array  # (N, K), 0 to 1
    sources: tuple[str, ...]  # N: the file, or image in it, that a row comes from
    image_size: Array | None = None  # (N, 2) width and height, pixels
    points_3d: Array | None = None  # (N, K, 3) m
    confidence_3d: Array | None = None  # (N, K)
    notes: tuple[str, ...] = ()  # what a user should know: people that were left out

    def __post_init__(self) -> None:
        rows, count = len(self.sources), len(self.names)
        for name, shape in {
            "points": (rows, count, 2),
            "confidence": (rows, count),
            "image_size": (rows, 2),
            "points_3d": (rows, count, 3),
            "confidence_3d": (rows, count),
        }.items():
            value = getattr(self, name)
            if value is None:
                continue
            if value.shape != shape:
                raise ValueError(f"{name}: expected shape {shape}, got {value.shape}")
            if not np.isfinite(value).all():
                raise ValueError(f"{name}: expected finite numbers, got NaN or infinity")
            if name.startswith("confidence") and not ((value >= 0) & (value <= 1)).all():
                raise ValueError(f"{name}: expected 0 to 1, got {value.min():g} to {value.max():g}")

    def __len__(self) -> int:
        return len(self.sources)

    def select(self, names: Sequence[str]) -> Detections:
        """The same people with exactly these points, in this order. Points that were not detected: confidence 0."""
        column = {name: index for index, name in enumerate(self.names)}
        columns = [column.get(name, len(self.names)) for name in names]

        def chosen(value: Array | None) -> Array | None:
            if value is None:
                return None
            nothing = np.zeros((len(value), 1, *value.shape[2:]))
            return np.concatenate([value, nothing], axis=1)[:, columns]

        points, confidence = chosen(self.points), chosen(self.confidence)
        assert points is not None
        assert confidence is not None
        others = chosen(self.points_3d), chosen(self.confidence_3d)
        return Detections(tuple(names), points, confidence, self.sources, self.image_size, *others, self.notes)


def join(parts: Sequence[Detections]) -> Detections:
    """Batches one below the other, with the points of all of them. What only some of them know is zeros in the others.

    ValueError if some have image sizes and others none.
    """
    names = tuple(dict.fromkeys(name for part in parts for name in part.names))
    parts = [part.select(names) for part in parts]
    sized = [part.image_size for part in parts if part.image_size is not None]
    if sized and len(sized) < len(parts):
        raise ValueError("image_size: some detections come with one and others without; give it for all")
    deep = any(part.points_3d is not None for part in parts)

    def rows(name: str, *shape: int) -> Array:
        values = [(getattr(part, name), len(part)) for part in parts]
        return np.concatenate([np.zeros((count, *shape)) if value is None else value for value, count in values])

    return Detections(
        names,
        rows("points", len(names), 2),
        rows("confidence", len(names)),
        tuple(source for part in parts for source in part.sources),
        rows("image_size", 2) if sized else None,
        rows("points_3d", len(names), 3) if deep else None,
        rows("confidence_3d", len(names)) if deep else None,
        tuple(note for part in parts for note in part.notes),
    )
