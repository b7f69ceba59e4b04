"""Two methods on the same frames, from what their accumulators hold."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from .accumulator import Accumulator
from .bootstrap import Interval, bootstrap
from .permutation_test import sign_flip


class PairedComparison(NamedTuple):
    """One metric of two methods over the sequences in which both have it for the same frames."""

    difference: Interval  # mean of first − second over the frames, and its bootstrap interval over sequences
    p: float  # of the sign-flip test
    frames: int
    clusters: int  # sequences; at most 4096, see `Accumulator`
    left_out: int  # sequences where one method has frames that the other has not


def compare(
    first: Accumulator, second: Accumulator, level: float = 0.95, resamples: int = 10_000, seed: int = 0
) -> dict[str, PairedComparison]:
    """Each metric that both have. NaN where there is no sequence with the same frames in both.

    Where single frames fail with one method, add the frames' differences to an accumulator of their own instead: a
    sequence with a failed frame is left out here, whole.
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
    found = [(i, rows[name]) for i, name in enumerate(one.names) if name in rows]
    same = [(i, j) for i, j in found if one.counts[i] == other.counts[j] and one.prints[i] == other.prints[j]]
    left_out = len(one.names) + len(other.names) - len(found) - len(same)
    if not same:
        return PairedComparison(Interval(np.nan, np.nan, np.nan), np.nan, 0, 0, left_out)
    i, j = np.transpose(same)
    sums, counts = one.sums[i] - other.sums[j], one.counts[i]
    frames = int(counts.sum())
    interval = bootstrap(sums, counts, float(sums.sum() / frames), level, resamples, seed)
    return PairedComparison(interval, sign_flip(sums, resamples, seed), frames, len(same), left_out)
