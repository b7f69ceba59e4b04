"""The sums of one metric of an accumulator, exact, one row per cluster."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from .clusters import CLUSTERS
from .exact_sum import LARGEST, LIMBS, exact, limbs


class Summary(NamedTuple):
    """One metric over all frames that have it; its unit is the metric's. NaN where there are too few frames."""

    mean: float
    std: float  # of the frames, with n − 1
    least: float
    largest: float
    frames: int  # with a value
    clusters: int  # sequences with a value; at most 4096, see `Accumulator`
    missing: dict[str, int]  # number of frames without a value, by reason


class MetricSums:
    """Exact sums of a metric by cluster (rows), with counts, extremes and reasons for missing values."""

    def __init__(self) -> None:
        self.sums = np.zeros((CLUSTERS, LIMBS), np.int64)
        self.counts = np.zeros(CLUSTERS, np.int64)
        self.prints = np.zeros(CLUSTERS, np.uint64)
        self.squares = np.zeros(LIMBS, np.int64)
        self.least, self.largest = math.inf, -math.inf
        self.missing: Counter[str] = Counter()

    def add(
        self, values: NDArray[np.float64], rows: NDArray[np.int64], prints: NDArray[np.uint64], why: NDArray[np.str_]
    ) -> None:
        """Adds values (n,) of the clusters `rows` (n,), with their frames' fingerprints and reasons for NaN."""
        valid = np.abs(values) < LARGEST  # false for NaN
        why = np.where(np.isnan(values), why, "infinite or over 2^31")
        self.missing.update(why[~valid].tolist())
        values, rows = values[valid], rows[valid]
        if not len(values):
            return
        for limb, total in zip(limbs(values).T, self.sums.T, strict=True):
            np.add.at(total, rows, limb)
        np.add.at(self.counts, rows, 1)
        np.add.at(self.prints, rows, prints[valid])
        self.squares += limbs(values**2).sum(axis=0)
        self.least, self.largest = min(self.least, float(values.min())), max(self.largest, float(values.max()))

    def merge(self, other: MetricSums, rows: NDArray[np.int64]) -> None:
        """Adds the sums of another object, whose row i is row rows[i] here."""
        number = len(rows)
        np.add.at(self.sums, rows, other.sums[:number])
        np.add.at(self.counts, rows, other.counts[:number])
        np.add.at(self.prints, rows, other.prints[:number])
        self.squares += other.squares
        self.least, self.largest = min(self.least, other.least), max(self.largest, other.largest)
        self.missing.update(other.missing)

    def arrays(self, rows: NDArray[np.int64]) -> dict[str, NDArray[Any]]:
        """These rows as arrays for a file; the reasons for missing values are not included."""
        return {
            "sums": self.sums[rows],
            "counts": self.counts[rows],
            "prints": self.prints[rows],
            "squares": self.squares,
            "edges": np.array([self.least, self.largest]),
        }

    @classmethod
    def from_arrays(cls, arrays: Mapping[str, NDArray[Any]], size: int, missing: Mapping[str, int]) -> MetricSums:
        """The inverse of `arrays`, from `size` rows. ValueError for other names, shapes, types or negative counts."""
        sums = cls()
        for name, expected in sums.arrays(np.arange(size)).items():
            array = arrays[name]
            if array.shape != expected.shape or array.dtype != expected.dtype:
                raise ValueError(f"{name}: expected {expected.shape} {expected.dtype}, got {array.shape} {array.dtype}")
        if (arrays["counts"] < 0).any() or not all(isinstance(n, int) and n > 0 for n in missing.values()):
            raise ValueError("counts: expected none below zero")
        sums.sums[:size], sums.counts[:size], sums.prints[:size] = (
            arrays[name] for name in ("sums", "counts", "prints")
        )
        sums.squares[:] = arrays["squares"]
        sums.least, sums.largest = arrays["edges"].tolist()
        sums.missing.update(missing)
        return sums

    def summary(self) -> Summary:
        """Mean, standard deviation and extremes over all frames."""
        frames, total = int(self.counts.sum()), exact(self.sums.sum(axis=0))
        mean, std = math.nan, math.nan
        if frames:
            mean = float(total / frames)
        if frames > 1:
            variance = (exact(self.squares) - total * total / frames) / (frames - 1)
            std = math.sqrt(max(variance, 0))
        return Summary(
            mean, std,
            self.least if frames else math.nan,
            self.largest if frames else math.nan,
            frames, int((self.counts > 0).sum()), dict(sorted(self.missing.items())),
        )  # fmt: skip
