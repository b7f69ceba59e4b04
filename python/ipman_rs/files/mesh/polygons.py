"""Polygons cut into triangles: a fan from the first corner of each."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray


def triangles(corners: NDArray[np.int64], counts: NDArray[np.int64]) -> NDArray[np.int64]:
    """(F, 3) of polygons that have ``counts`` corners, one after the other in ``corners``; below three: none."""
    fans = np.maximum(counts - 2, 0)
    starts = np.repeat(np.cumsum(counts) - counts, fans)
    step = np.arange(len(starts)) - np.repeat(np.cumsum(fans) - fans, fans)
    return corners[np.stack([starts, starts + step + 1, starts + step + 2], axis=1)]
