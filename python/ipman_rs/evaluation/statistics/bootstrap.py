"""Bootstrap intervals of a mean over bodies, or over sequences of bodies.

Frames of a sequence are correlated, so whole sequences are drawn with replacement (cluster bootstrap). An image is a
sequence of one frame. More than 4096 sequences are first pooled at random into 4096 clusters, which bounds memory and
time and changes an interval's width by about a hundredth.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .clusters import differences

DRAWS = 1 << 20  # drawn clusters that are in memory together


class Interval(NamedTuple):
    """A mean, or the mean difference of two methods, and the ends of its interval."""

    mean: float
    low: float
    high: float

    @property
    def excludes_zero(self) -> bool:
        return self.low > 0 or self.high < 0


def paired(
    values: ArrayLike,
    baseline: ArrayLike,
    level: float = 0.95,
    resamples: int = 10_000,
    seed: int = 0,
    sequences: ArrayLike | None = None,
) -> Interval:
    """Percentile interval of the mean of values (n,) − baseline (n,) over bodies drawn with replacement.

    Bodies where either value is not finite are left out.

    Args:
        sequences: (n,) names of the bodies' sequences; then whole sequences are drawn.

    Raises:
        ValueError: the arrays differ in length, or no body has two finite values.
    """
    difference, sums, counts = differences(values, baseline, sequences)
    return bootstrap(sums, counts, float(difference.mean()), level, resamples, seed)


def bootstrap(
    sums: NDArray[Any], counts: NDArray[Any], mean: float, level: float = 0.95, resamples: int = 10_000, seed: int = 0
) -> Interval:
    """Percentile interval of a mean from the sum (G,) and the number (G,) of each cluster's values.

    The ends are NaN for fewer than two clusters.

    Raises:
        ValueError: the level is not between 0 and 1.
    """
    if not 0 < level < 1:
        raise ValueError(f"level: expected a share between 0 and 1, got {level!r}")
    if len(sums) < 2:
        return Interval(mean, np.nan, np.nan)
    draw, means = np.random.default_rng(seed), np.empty(resamples)
    block = max(1, DRAWS // len(sums))
    for start in range(0, resamples, block):
        part = means[start : start + block]
        drawn = draw.integers(len(sums), size=(len(part), len(sums)))
        part[:] = sums[drawn].sum(axis=1) / counts[drawn].sum(axis=1)
    tail = 100 * (1 - level) / 2
    low, high = np.percentile(means, [tail, 100 - tail])
    return Interval(mean, float(low), float(high))
