"""Paired bootstrap: what the mean difference of two methods on the same bodies would be on other bodies."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike


class Interval(NamedTuple):
    """The mean difference and the ends of its interval."""

    mean: float
    low: float
    high: float

    @property
    def excludes_zero(self) -> bool:
        return self.low > 0 or self.high < 0


def paired(
    values: ArrayLike, baseline: ArrayLike, level: float = 0.95, resamples: int = 10_000, seed: int = 0
) -> Interval:
    """Percentile interval of the mean of values (n,) − baseline (n,) over bodies drawn with replacement.

    ValueError for arrays of different lengths, or without bodies.
    """
    values, baseline = np.asarray(values, float), np.asarray(baseline, float)
    if values.shape != baseline.shape or values.ndim != 1 or not len(values):
        raise ValueError(f"values: expected two arrays (n,) of one length, got {values.shape} and {baseline.shape}")
    difference = values - baseline
    drawn = np.random.default_rng(seed).integers(len(difference), size=(resamples, len(difference)))
    tail = 100 * (1 - level) / 2
    low, high = np.percentile(difference[drawn].mean(axis=1), [tail, 100 - tail])
    return Interval(float(difference.mean()), float(low), float(high))
