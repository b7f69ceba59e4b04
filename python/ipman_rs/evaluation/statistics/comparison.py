"""Paired comparison of two methods on the same frames, from their accumulators."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from .accumulator import Accumulator
from .bootstrap import Interval, bootstrap
from .permutation_test import sign_flip


class PairedComparison(NamedTuple):
    """One metric of two methods, over the sequences in which both have it for the same frames."""

    difference: Interval  # mean of first − second over the frames, and its bootstrap interval over sequences
    p: float  # of the sign-flip test
    frames: int
    clusters: int  # sequences; at most 4096, see `Accumulator`
    left_out: int  # sequences where one method has frames that the other has not


def compare(
    first: Accumulator, second: Accumulator, level: float = 0.95, resamples: int = 10_000, seed: int = 0
) -> dict[str, PairedComparison]:
    """The comparison of each metric that both have. NaN where no sequence has the same frames in both.

    A sequence in which one method failed on a frame is left out as a whole. To keep its other frames, add the
    differences of the frames to an accumulator of their own instead.
    """
    if first.is_pooled != second.is_pooled:
        first, second = first.pooled(), second.pooled()
    both = sorted(first.summary().keys() & second.summary().keys())
    return {metric: _compare(first, second, metric, level, resamples, seed) for metric in both}


def _compare(
    first: Accumulator, second: Accumulator, metric: str, level: float, resamples: int, seed: int
) -> PairedComparison:
    one, other = first.clusters(metric), second.clusters(metric)
    rows = {name: row for row, name in enumerate(other.names)}
    shared = [(i, rows[name]) for i, name in enumerate(one.names) if name in rows]
    same = [(i, j) for i, j in shared if one.counts[i] == other.counts[j] and one.prints[i] == other.prints[j]]
    left_out = len(one.names) + len(other.names) - len(shared) - len(same)
    if not same:
        return PairedComparison(Interval(np.nan, np.nan, np.nan), np.nan, 0, 0, left_out)
    i, j = np.transpose(same)
    sums, counts = one.sums[i] - other.sums[j], one.counts[i]
    frames = int(counts.sum())
    interval = bootstrap(sums, counts, float(sums.sum() / frames), level, resamples, seed)
    return PairedComparison(interval, sign_flip(sums, resamples, seed), frames, len(same), left_out)
