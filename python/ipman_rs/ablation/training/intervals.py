"""Confidence intervals of the difference of two rows: over the bodies, and over the seeds of training."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ipman_rs.evaluation import Interval

Array = NDArray[np.floating]

RESAMPLES, LEVEL = 10_000, 0.95


def paired_over_seeds(values: Array, baseline: Array, seed: int = 0) -> Interval:
    """Percentile interval of the mean of values − baseline (seeds, bodies), drawn anew with replacement: whole seeds,
    and the same bodies for all seeds. Three seeds say little about seeds: the interval is then rather too narrow.

    ValueError for arrays of different shapes, or without numbers.
    """
    difference = np.asarray(values, float) - np.asarray(baseline, float)
    if np.shape(values) != np.shape(baseline) or difference.ndim != 2 or not difference.size:
        raise ValueError(
            f"values: expected two arrays (seeds, bodies) of one shape, got {np.shape(values)} and {np.shape(baseline)}"
        )
    draw = np.random.default_rng(seed)
    seeds, bodies = difference.shape
    means = np.empty(RESAMPLES)
    for sample in range(RESAMPLES):
        of_bodies = difference[draw.integers(seeds, size=seeds)].mean(axis=0)
        means[sample] = of_bodies[draw.integers(bodies, size=bodies)].mean()
    low, high = np.percentile(means, [50 * (1 - LEVEL), 50 * (1 + LEVEL)])
    return Interval(float(difference.mean()), float(low), float(high))
