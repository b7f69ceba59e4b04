"""Geometry that pictures share: smooth normals, the pressure on the skin, the floor grid, the hull's nearest point."""

from __future__ import annotations

import numpy as np


def pressure_at(height: np.ndarray, alpha: float, gamma: float) -> np.ndarray:
    """Relative pressure of points at signed heights, 1 - alpha h below the ground and exp(-gamma h) above.

    ``ip.pressure`` gives it at the samples; pictures need it at every pixel of the skin.
    """
    return np.where(height < 0, 1.0 - alpha * height, np.exp(-gamma * np.maximum(height, 0.0)))


def floor_lines(
    center: np.ndarray, e1: np.ndarray, e2: np.ndarray, radius: float, step: float, pieces: int = 48
) -> tuple[np.ndarray, np.ndarray]:
    """A round floor grid: segments (N, 2, 3) and their strength (N,), 1 in the middle and 0 at ``radius``.

    Lines lie on multiples of ``step``, so that one square of the grid is a length one can read.
    """
    along = np.linspace(-radius, radius, pieces + 1)
    segments = []
    for axis, other in ((e1, e2), (e2, e1)):
        middle = float(center @ other)
        first, last = int(np.ceil((middle - radius) / step)), int(np.floor((middle + radius) / step))
        for offset in np.arange(first, last + 1) * step - middle:
            points = center + along[:, None] * axis + offset * other
            segments.append(np.stack([points[:-1], points[1:]], axis=1))
    lines = np.concatenate(segments)
    away = np.linalg.norm(lines.mean(axis=1) - center, axis=-1) / radius
    strength = np.clip(1.0 - away**2, 0.0, 1.0)
    return lines[strength > 0], strength[strength > 0]


def nearest_on_outline(point: np.ndarray, polygon: np.ndarray) -> np.ndarray:
    """The point (3,) of a closed outline (K, 3) nearest to ``point``."""
    start, end = polygon, np.roll(polygon, -1, axis=0)
    edge = end - start
    length = np.maximum((edge * edge).sum(axis=-1), 1e-30)
    t = np.clip(((point - start) * edge).sum(axis=-1) / length, 0.0, 1.0)
    candidates = start + t[:, None] * edge
    return candidates[np.argmin(np.linalg.norm(candidates - point, axis=-1))]


def grid_step(radius: float) -> float:
    """A round grid spacing in metres, about four squares to the radius."""
    ideal = max(radius / 4.0, 1e-6)
    power = 10.0 ** np.floor(np.log10(ideal))
    return float(min((power * k for k in (1.0, 2.0, 5.0, 10.0)), key=lambda step: abs(np.log(step / ideal))))
