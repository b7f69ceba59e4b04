"""Paired permutation test between two methods (Fisher's randomisation test, two-sided).

If two methods are equally good, the difference of each sequence could as well have the opposite sign. p is the share of
all choices of signs whose mean is at least as far from zero as the observed one.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .bootstrap import DRAWS
from .clusters import differences


def paired_test(
    values: ArrayLike, baseline: ArrayLike, resamples: int = 10_000, seed: int = 0, sequences: ArrayLike | None = None
) -> float:
    """p of the mean of values (n,) − baseline (n,), by bodies, or by sequences if their names (n,) are given.

    Raises:
        ValueError: as `paired`.
    """
    _, sums, _ = differences(values, baseline, sequences)
    return sign_flip(sums, resamples, seed)


def sign_flip(sums: NDArray[np.float64], resamples: int = 10_000, seed: int = 0) -> float:
    """p from the clusters' sums of differences (G,): over all 2^G choices of signs if there are at most `resamples`,
    else over that many drawn ones and the observed one."""
    clusters = len(sums)
    least = abs(sums.sum()) - 1e-12 * np.abs(sums).sum()  # equal but for rounding counts as equal
    every = clusters < 60 and 2**clusters <= resamples
    number = 2**clusters if every else resamples
    draw, block, extreme = np.random.default_rng(seed), max(1, DRAWS // clusters), 0
    for start in range(0, number, block):
        rows = np.arange(start, min(start + block, number))
        up = _bits(rows, clusters) if every else draw.integers(2, size=(len(rows), clusters), dtype=np.bool_)
        extreme += int((np.abs(np.where(up, sums, -sums).sum(axis=1)) >= least).sum())
    return extreme / number if every else (extreme + 1) / (number + 1)


def _bits(numbers: NDArray[np.int64], count: int) -> NDArray[np.bool_]:
    """The lowest `count` bits of each number, (n, count)."""
    return (numbers[:, None] >> np.arange(count)) & 1 == 1
