"""How far markers are from the skin of fitted bodies: outside it positive, inside negative."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ipman_rs.data.check import evenly

Array = NDArray[np.float64]

FRAMES = 8  # of those in which a marker was seen, spread over them


def mean_distances(vertices: NDArray[np.floating], faces: NDArray[np.integer], points: Array, visible: Array) -> Array:
    """The mean signed distance (M,), m, of markers (T, M, 3) from bodies (T, V, 3), over some of the frames in which
    they were seen (T, M); NaN for one that never was."""
    away = np.full(visible.shape, np.nan)
    chosen = np.zeros(visible.shape, bool)
    for marker in range(visible.shape[1]):
        frames = np.flatnonzero(visible[:, marker])
        chosen[frames[evenly(len(frames), FRAMES)], marker] = True
    for frame in np.flatnonzero(chosen.any(axis=1)):
        corners = np.asarray(vertices[frame], np.float64)[faces]
        for marker in np.flatnonzero(chosen[frame]):
            away[frame, marker] = signed_distance(points[frame, marker], corners)
    counts = chosen.sum(axis=0)
    return np.where(counts > 0, np.nansum(away, axis=0) / np.maximum(counts, 1), np.nan)


def signed_distance(point: Array, corners: Array) -> float:
    """From a point (3,) to the nearest of the triangles (F, 3, 3) of a closed surface; negative inside it."""
    sides = np.roll(corners, -1, axis=1) - corners
    away = point - corners
    along = np.clip((away * sides).sum(-1) / np.maximum((sides**2).sum(-1), 1e-30), 0, 1)
    nearest = ((away - along[..., None] * sides) ** 2).sum(-1).min(axis=1)  # by the edges
    normal = np.cross(sides[:, 0], -sides[:, 2])
    above = (np.cross(sides, away) * normal[:, None]).sum(-1) >= 0  # on the inner side of each edge
    height = (away[:, 0] * normal).sum(-1) ** 2 / np.maximum((normal**2).sum(-1), 1e-30)
    nearest = np.where(above.all(axis=1), np.minimum(nearest, height), nearest)
    return float(np.sqrt(nearest.min())) * (-1 if _winding(away) > 0.5 else 1)


def _winding(away: Array) -> float:
    """How often the triangles wind around the point, which sees their corners at −away (F, 3, 3): van Oosterom and
    Strackee, The solid angle of a plane triangle, 1983."""
    a, b, c = np.moveaxis(-away, 1, 0)
    lengths = [np.linalg.norm(each, axis=-1) for each in (a, b, c)]
    triple = (a * np.cross(b, c)).sum(-1)
    rest = lengths[0] * lengths[1] * lengths[2]
    rest += (a * b).sum(-1) * lengths[2] + (b * c).sum(-1) * lengths[0] + (c * a).sum(-1) * lengths[1]
    return float(np.arctan2(triple, rest).sum()) / (2 * np.pi)
