"""A z-buffer in numpy: triangles to pixels without OpenGL, so that pictures need no display and no driver."""

from __future__ import annotations

import numpy as np

# Candidate pixels handled at once: few enough to stay in the cache.
_CHUNK = 100_000


def rasterize(
    corners: np.ndarray, nearness: np.ndarray, attributes: np.ndarray, width: int, height: int
) -> tuple[np.ndarray, np.ndarray]:
    """Draw triangles, the nearest one on top.

    ``corners`` (F, 3, 2) in pixels, x to the right and y downwards; ``nearness`` (F, 3), larger is nearer (1/depth is
    linear in the picture); ``attributes`` (F, 3, C), interpolated inside each triangle.
    Returns ``(image (height, width, C), covered (height, width) bool)``.
    """
    channels = attributes.shape[-1]
    best = np.full(height * width, -np.inf)
    image = np.zeros((height * width, channels))
    low, counts = _pixel_boxes(corners, width, height)
    boxes = np.flatnonzero(counts.prod(axis=1) > 0)
    for chunk in _chunks(boxes, counts.prod(axis=1)):
        triangle, pixel = _candidates(chunk, low, counts)
        weights, inside = _barycentric(corners[triangle], pixel + 0.5)
        triangle, pixel, weights = triangle[inside], pixel[inside], weights[inside]
        near = np.einsum("nk,nk->n", weights, nearness[triangle])
        index = pixel[:, 1] * width + pixel[:, 0]
        np.maximum.at(best, index, near)
        front = near >= best[index]
        image[index[front]] = np.einsum("nk,nkc->nc", weights[front], attributes[triangle[front]])
    return image.reshape(height, width, channels), np.isfinite(best).reshape(height, width)


def _pixel_boxes(corners: np.ndarray, width: int, height: int) -> tuple[np.ndarray, np.ndarray]:
    """First pixel (F, 2) and pixel counts (F, 2) of each triangle's bounding box, cut to the picture."""
    size = np.array([width, height])
    finite = np.asarray(np.isfinite(corners).all(axis=(1, 2)))
    safe = np.where(finite[:, None, None], corners, -1.0)
    low = np.clip(np.floor(safe.min(axis=1) - 0.5), 0, size).astype(np.int64)
    high = np.clip(np.ceil(safe.max(axis=1) + 0.5), 0, size).astype(np.int64)
    return low, np.where(finite[:, None], high - low, 0)


def _chunks(boxes: np.ndarray, counts: np.ndarray) -> list[np.ndarray]:
    if len(boxes) == 0:
        return []
    total = np.cumsum(counts[boxes])
    cuts = np.searchsorted(total, np.arange(_CHUNK, total[-1], _CHUNK))
    return [part for part in np.split(boxes, np.unique(cuts)) if len(part)]


def _candidates(boxes: np.ndarray, low: np.ndarray, counts: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Every pixel of every box: the triangle (N,) and the pixel (N, 2)."""
    number = counts[boxes].prod(axis=1)
    triangle = np.repeat(boxes, number)
    offset = np.arange(number.sum()) - np.repeat(np.cumsum(number) - number, number)
    columns = counts[triangle, 0]
    return triangle, low[triangle] + np.stack([offset % columns, offset // columns], axis=-1)


def _barycentric(corners: np.ndarray, points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Weights (N, 3) of points in triangles (N, 3, 2), and which points lie inside."""
    a, b, c = corners[:, 0], corners[:, 1], corners[:, 2]
    area = _cross(b - a, c - a)
    ok = np.abs(area) > 1e-12
    area = np.where(ok, area, 1.0)
    u = _cross(c - b, points - b) / area
    v = _cross(a - c, points - c) / area
    weights = np.stack([u, v, 1.0 - u - v], axis=-1)
    return weights, ok & (weights >= -1e-9).all(axis=1)


def _cross(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    return a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]


def faces_viewer(corners: np.ndarray) -> np.ndarray:
    """Which triangles (F, 3, 2), counter-clockwise seen from outside, turn their outside to the viewer (y is down)."""
    return _cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]) < 0


def shrink(image: np.ndarray, factor: int) -> np.ndarray:
    """Mean over blocks of ``factor`` x ``factor`` pixels: the antialiasing."""
    height, width = image.shape[0] // factor, image.shape[1] // factor
    blocks = image[: height * factor, : width * factor].reshape(height, factor, width, factor, -1)
    return blocks.mean(axis=(1, 3))
