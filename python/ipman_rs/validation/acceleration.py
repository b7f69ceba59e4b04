"""Accelerations of recorded paths."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

Array = NDArray[np.float64]

CUTOFF = 6.0  # Hz: gait has next to nothing above it, markers have noise


def accelerations(points: ArrayLike, rate: float, cutoff: float = CUTOFF) -> Array:
    """Second derivatives (T, ..., 3), m/s², of paths (T, ..., 3) m at `rate` points a second, after a low pass.

    The filter is Butterworth's of fourth order without lag, as gait laboratories use it. NaN for 1/cutoff s at both
    ends, where it has not settled. ValueError for a rate under four times the cutoff.
    """
    from scipy.signal import butter, sosfiltfilt

    points = np.asarray(points, float)
    if not rate >= 4 * cutoff:
        raise ValueError(f"rate: expected {4 * cutoff:g} points a second or more for accelerations, got {rate:g}")
    second = np.full_like(points, np.nan)
    unsettled = int(np.ceil(rate / cutoff))
    if len(points) <= 2 * unsettled + 2:
        return second
    smooth = sosfiltfilt(butter(2, cutoff, fs=rate, output="sos"), points, axis=0)
    inner = slice(unsettled, len(points) - unsettled)
    second[1:-1] = (smooth[2:] - 2 * smooth[1:-1] + smooth[:-2]) * rate**2
    settled = np.full_like(second, np.nan)
    settled[inner] = second[inner]
    return settled
