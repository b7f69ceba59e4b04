"""The paired test between two methods: could their difference be chance?

If two methods were equally good, each sequence's difference could as well have the other sign. p is the share of all
ways to choose signs that move the mean at least as far from zero as it is (Fisher's randomisation test, two-sided).
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .bootstrap import DRAWS
from .clusters import differences


def paired_test(
    values: ArrayLike, baseline: ArrayLike, resamples: int = 10_000, seed: int = 0, sequences: ArrayLike | None = None
) -> float:
    """p of the mean of values (n,) − baseline (n,), for bodies, or for whole sequences (n,) where their names are
    given. ValueError as `paired`."""
    _, sums, _ = differences(values, baseline, sequences)
    return sign_flip(sums, resamples, seed)


def sign_flip(sums: NDArray[np.float64], resamples: int = 10_000, seed: int = 0) -> float:
    """p of the clusters' sums of differences (G,): from all 2^G choices of signs where these are no more than
    `resamples`, else from that many drawn ones, the real one counted among them."""
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
    return (numbers[:, None] >> np.arange(count)) & 1 == 1
