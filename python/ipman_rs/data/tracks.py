"""Recorded paths of markers."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

METRES = {"m": 1.0, "meters": 1.0, "metres": 1.0, "dm": 0.1, "cm": 0.01, "mm": 0.001, "um": 1e-6, "in": 0.0254}
# Rotations that lead from a file's axes to ours, y up.
TO_Y_UP = {
    "x": np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]]),
    "y": np.eye(3),
    "z": np.array([[1.0, 0.0, 0.0], [0.0, 0.0, 1.0], [0.0, -1.0, 0.0]]),
}
LARGEST = 20.0  # nobody's markers are farther apart, in metres; in millimetres everybody's are


@dataclass(frozen=True, eq=False)
class Tracks:
    """M markers in T samples, metres, y up. A marker that was not seen has confidence 0 and lies at 0."""

    names: tuple[str, ...]  # M
    points: Array  # (T, M, 3) m
    confidence: Array  # (T, M), 0 or 1
    times: Array  # (T,) s
    source: str

    def __len__(self) -> int:
        return len(self.times)

    def select(self, names: Sequence[str]) -> Tracks:
        """These markers, in this order. ValueError for one that was not recorded."""
        missing = [name for name in names if name not in self.names]
        if missing:
            raise ValueError(f"names: {self.source} has no marker {missing[0]!r}; it has {', '.join(self.names)}")
        columns = [self.names.index(name) for name in names]
        return Tracks(tuple(names), self.points[:, columns], self.confidence[:, columns], self.times, self.source)


def tracks(names: Sequence[str], points: Array, times: Array, unit: str, up: str, source: str) -> Tracks:
    """From a file's own numbers: NaN, or exactly the origin, is a marker that was not seen. `unit` "" is guessed.

    ValueError for an unknown unit or axis, for no marker or sample, for a name that comes twice, if nothing was seen,
    and for infinite coordinates.
    """
    if up not in TO_Y_UP:
        raise ValueError(f"up: expected x, y or z, got {up!r}")
    if points.size == 0:
        raise ValueError(f"{source}: expected markers and samples, got {points.shape[1]} and {points.shape[0]}")
    twice = [name for index, name in enumerate(names) if name in names[:index]]
    if twice:
        raise ValueError(f"{source}: the marker {twice[0]!r} comes twice")
    if np.isinf(points).any():
        sample, marker, _ = np.argwhere(np.isinf(points))[0]
        raise ValueError(f"{source}: sample {sample}, marker {names[marker]!r}: expected numbers, got infinity")
    seen = ~np.isnan(points).any(-1) & (points != 0).any(-1)
    if not seen.any():
        raise ValueError(f"{source}: expected coordinates, all are missing")
    scale = _scale(unit, points[seen], source)
    turned = np.where(seen[..., None], points, 0.0) * scale @ TO_Y_UP[up].T
    return Tracks(tuple(names), turned, seen.astype(float), np.asarray(times, float), source)


def _scale(unit: str, seen: Array, source: str) -> float:
    """Metres a unit."""
    if unit:
        if unit.lower() not in METRES:
            raise ValueError(f"{source}: units: expected one of {', '.join(METRES)}, got {unit!r}")
        return METRES[unit.lower()]
    return METRES["mm"] if np.ptp(seen, axis=0).max() > LARGEST else METRES["m"]
