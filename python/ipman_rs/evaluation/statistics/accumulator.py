"""Sums of metrics over any number of frames in constant memory, with the same bits for any order of shards."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ipman_rs.files import atomic_write, parse_json, safe_npz

from ..numpy_or_torch import as_array
from .bootstrap import Interval, bootstrap
from .clusters import CLUSTERS, fingerprints, pooled_clusters
from .exact_sum import exact
from .metric_sums import MetricSums, Summary

FORMAT = "ipman_rs accumulator 1"
ARRAYS = ("sums", "counts", "prints", "squares", "edges")


class Clusters(NamedTuple):
    """The sums of a metric by cluster, in the order of the clusters' names."""

    names: list[str]  # sequences, or the numbers of the clusters that they were pooled into
    sums: NDArray[np.float64]  # (G,) exact, rounded once
    counts: NDArray[np.int64]  # (G,) frames with a value
    prints: NDArray[np.uint64]  # (G,) sum of the fingerprints of the frames' names, which identifies the frames


class Accumulator:
    """Sums of metrics, one number per frame, by metric and sequence.

    Sums are exact (`exact_sum`), so `summary` and `intervals` depend only on which frames were added, not on their
    order or on how they were distributed over merged accumulators. The mean is the exact one, rounded once.

    Memory does not grow with the number of frames. Sums are kept per sequence, for the intervals; beyond 4096 sequences
    (a single image is one), per cluster instead, of 4096 clusters to which a hash of their names assigns the sequences.
    Whether that happens depends on the set of all sequences, so it is the same for any shards.
    """

    def __init__(self) -> None:
        self._rows: dict[str, int] | None = {}  # of each sequence; None once they are pooled
        self._columns: dict[str, MetricSums] = {}

    def add(
        self,
        figures: Mapping[str, ArrayLike],
        names: Sequence[str] | NDArray[np.str_],
        sequences: Sequence[str] | NDArray[np.str_],
        why: Mapping[str, ArrayLike] | ArrayLike = "undefined",
    ) -> None:
        """Adds frames; none of them may have been added before.

        Args:
            figures: {metric: (F,)}; values that are not finite count as missing.
            names: (F,) of the frames, unique in the data set, by which `compare` checks that methods have the same.
            sequences: (F,) names.
            why: the reason for a missing value: one text, (F,) texts for all metrics, or {metric: either of these}; see
                `reasons`. Used only where a value is missing.

        Raises:
            ValueError: lengths differ; then nothing is added.
        """
        frames, groups = [str(name) for name in names], [str(name) for name in sequences]
        if len(groups) != len(frames):
            raise ValueError(f"sequences: expected a name per frame, {len(frames)}, got {len(groups)}")
        values = {metric: _numbers(metric, value, len(frames)) for metric, value in figures.items()}
        words = {metric: _words(metric, why, len(frames)) for metric in figures}
        rows, prints = self._rows_of(groups), fingerprints(frames)
        for metric, value in values.items():
            self._columns.setdefault(metric, MetricSums()).add(value, rows, prints, words[metric])

    def merge(self, other: Accumulator) -> None:
        """Adds the frames of another accumulator, which is not changed and must hold none of the frames of this one."""
        if other._rows is None:
            self._pool()
            rows = np.arange(CLUSTERS)
        else:
            rows = self._rows_of(list(other._rows))
        for metric, column in other._columns.items():
            self._columns.setdefault(metric, MetricSums()).merge(column, rows)

    def summary(self) -> dict[str, Summary]:
        """The summary of each metric, in the order of the metrics' names."""
        return {metric: column.summary() for metric, column in sorted(self._columns.items())}

    def intervals(self, level: float = 0.95, resamples: int = 10_000, seed: int = 0) -> dict[str, Interval]:
        """The mean of each metric and its bootstrap interval over sequences; NaN ends for fewer than two."""
        intervals = {}
        for metric, summary in self.summary().items():
            clusters = self.clusters(metric)
            intervals[metric] = bootstrap(clusters.sums, clusters.counts, summary.mean, level, resamples, seed)
        return intervals

    def clusters(self, metric: str) -> Clusters:
        """The clusters that have values of this metric. ValueError for a metric that was never added."""
        if metric not in self._columns:
            raise ValueError(f"metric: expected one of {', '.join(sorted(self._columns)) or 'none'}, got {metric!r}")
        column = self._columns[metric]
        order = {name: row for name, row in self._order().items() if column.counts[row]}
        rows = np.fromiter(order.values(), np.int64)
        sums = np.array([float(exact(total)) for total in column.sums[rows]])
        return Clusters(list(order), sums, column.counts[rows], column.prints[rows])

    def pooled(self) -> Accumulator:
        """A copy whose sequences are pooled by the hash of their names, even if they are few."""
        copy = Accumulator()
        copy.merge(self)
        copy._pool()
        return copy

    @property
    def is_pooled(self) -> bool:
        """Whether there were more sequences than are kept apart."""
        return self._rows is None

    def save(self, path: str | Path) -> None:
        """Writes an `.npz` without pickles, with the same bytes for the same frames. It appears when it is complete."""
        target, order = Path(path), self._order()
        columns = dict(sorted(self._columns.items()))
        head = {
            "format": FORMAT,
            "metrics": list(columns),
            "sequences": None if self._rows is None else list(order),
            "missing": [dict(sorted(column.missing.items())) for column in columns.values()],
        }
        rows = np.fromiter(order.values(), np.int64)
        arrays = [column.arrays(rows) for column in columns.values()]
        stacked: dict[str, Any] = {name: np.array([each[name] for each in arrays]) for name in ARRAYS} if arrays else {}
        with atomic_write(target) as file:
            np.savez(file, head=np.frombuffer(json.dumps(head).encode(), np.uint8), **stacked)

    @classmethod
    def load(cls, path: str | Path) -> Accumulator:
        """The accumulator that `save` wrote. ValueError for a damaged, incomplete or other file."""
        path = Path(path)
        try:
            return cls._read(path)
        except (LookupError, TypeError, AttributeError, ValueError, ArithmeticError) as error:
            raise ValueError(
                f"{path}: no accumulator can be read from it ({error}); if it is a shard's, run that shard again"
            ) from error

    @classmethod
    def _read(cls, path: Path) -> Accumulator:
        head = parse_json(safe_npz.read(path, "head").tobytes())
        if head["format"] != FORMAT:
            raise ValueError(f"format: expected {FORMAT!r}, got {head['format']!r}")
        metrics, sequences, missing = head["metrics"], head["sequences"], head["missing"]
        accumulator = cls()
        accumulator._rows = None if sequences is None else {str(name): row for row, name in enumerate(sequences)}
        size = CLUSTERS if sequences is None else len(sequences)
        if not size == len(accumulator._order()) <= CLUSTERS:
            raise ValueError(f"sequences: expected different names, {CLUSTERS} at most")
        arrays = {name: safe_npz.read(path, name) for name in ARRAYS} if metrics else {}
        columns = [dict(zip(arrays, row, strict=True)) for row in zip(*arrays.values(), strict=True)]
        for metric, column, counts in zip(metrics, columns, missing, strict=True):
            accumulator._columns[str(metric)] = MetricSums.from_arrays(column, size, counts)
        return accumulator

    def _rows_of(self, sequences: Sequence[str]) -> NDArray[np.int64]:
        """The row of each sequence; new ones are added first."""
        if self._rows is not None:
            every = dict.fromkeys([*self._rows, *sequences])
            if len(every) > CLUSTERS:
                self._pool()
            else:
                self._rows = {name: row for row, name in enumerate(every)}
        if self._rows is None:
            return pooled_clusters(sequences)
        return np.array([self._rows[name] for name in sequences], np.int64)

    def _pool(self) -> None:
        """Merges the rows of sequences into clusters."""
        if self._rows is not None:
            rows = pooled_clusters(list(self._rows))
            for metric, apart in self._columns.items():
                self._columns[metric] = MetricSums()
                self._columns[metric].merge(apart, rows)
        self._rows = None

    def _order(self) -> dict[str, int]:
        """Names and rows of the clusters, sorted by name, so that they do not depend on the order of adding."""
        if self._rows is None:
            return {str(row): row for row in range(CLUSTERS)}
        return dict(sorted(self._rows.items()))


def _numbers(metric: str, value: ArrayLike, frames: int) -> NDArray[np.float64]:
    values = np.asarray(as_array(value), np.float64)
    if values.shape != (frames,):
        raise ValueError(f"{metric}: expected a number per frame, ({frames},), got {values.shape}")
    return values


def _words(metric: str, why: Any, frames: int) -> NDArray[np.str_]:
    words = np.asarray(why.get(metric, "undefined") if isinstance(why, Mapping) else why).astype(str)
    if words.shape not in ((), (frames,)):
        raise ValueError(f"why: expected a word or a word per frame, ({frames},), got {words.shape}")
    return np.where(words == "", "undefined", np.broadcast_to(words, (frames,)))
