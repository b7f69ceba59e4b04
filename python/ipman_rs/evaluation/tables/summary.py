"""Results over all pieces: means with intervals, distributions, and differences between two methods."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..statistics.accumulator import Accumulator, Clusters
from ..statistics.bootstrap import Interval
from ..statistics.metric_sums import Summary
from ..statistics.permutation_test import sign_flip
from .frame_metrics import Columns
from .job import Job
from .metrics import METRICS

# Bounds of the distributions of lengths and angles: 0.1 mm to 10 m, or rad.
EDGES = np.logspace(-4, 1, 251)


@dataclass
class MethodSummary:
    """The results of one method over all frames."""

    name: str
    summary: dict[str, Summary]
    intervals: dict[str, Interval]
    below: dict[str, NDArray[np.int64]]  # number of frames below each of EDGES
    frames: int
    clusters: dict[str, Clusters]  # sums per sequence
    pooled: bool  # there were too many sequences to keep them apart


@dataclass
class Difference:
    """Differences between two methods, on the frames where both have the metric."""

    name: str
    baseline: str
    intervals: dict[str, Interval]
    p: dict[str, float]  # of the sign-flip test over sequences
    frames: dict[str, int]


@dataclass
class _Sums:
    sums: Accumulator = field(default_factory=Accumulator)
    below: dict[str, NDArray[np.int64]] = field(default_factory=dict)
    frames: int = 0

    def add(self, piece: Columns) -> None:
        figures = {name: value for name, value in piece.items() if name in METRICS}
        why = {name: np.where(piece["why"] == "", METRICS[name].undefined, piece["why"]) for name in figures}
        self.sums.add(figures, piece["names"], piece["sequences"], why)
        self.frames += len(piece["names"])
        for name, value in figures.items():
            if METRICS[name].unit in ("mm", "°"):
                counts = np.searchsorted(np.sort(value[np.isfinite(value)]), EDGES)
                self.below[name] = self.below.get(name, 0) + counts


def summarise(job: Job, progress: Callable[[int], None] = lambda frames: None) -> MethodSummary:
    """The results of a job. ValueError if a piece is missing or damaged."""
    sums = _Sums()
    for piece in job.results():
        sums.add(piece)
        progress(len(piece["names"]))
    total = sums.sums
    summary = _ordered(total.summary())
    clusters = {name: total.clusters(name) for name in summary}
    return MethodSummary(job.name, summary, total.intervals(), sums.below, sums.frames, clusters, total.is_pooled)


def difference(job: Job, baseline: Job, progress: Callable[[int], None] = lambda frames: None) -> Difference:
    """The differences of two jobs on the same data. ValueError if a piece is missing or damaged."""
    sums = Accumulator()
    for own, other in zip(job.results(), baseline.results(), strict=True):
        both, mine, theirs = _common(own, other)
        shared = [name for name in METRICS if name in own and name in other]
        figures = {name: own[name][mine] - other[name][theirs] for name in shared}
        sums.add(figures, both, own["sequences"][mine])
        progress(len(own["names"]))
    summary = sums.summary()
    p = {name: sign_flip(sums.clusters(name).sums) for name, each in summary.items() if each.frames}
    frames = {name: each.frames for name, each in summary.items()}
    return Difference(job.name, baseline.name, _ordered(sums.intervals()), p, frames)


def _common(own: Columns, other: Columns) -> tuple[NDArray[Any], NDArray[Any], NDArray[Any]]:
    """The frames that two pieces share, and their rows in each: with `partial` each may lack some."""
    if np.array_equal(own["names"], other["names"]):
        rows = np.arange(len(own["names"]))
        return own["names"], rows, rows
    return np.intersect1d(own["names"], other["names"], return_indices=True)


def _ordered(by_metric: dict[str, Any]) -> dict[str, Any]:
    return {name: by_metric[name] for name in METRICS if name in by_metric}


def pieces_by_method(jobs: list[Job]) -> Iterator[tuple[str, Columns]]:
    """The name of the method and its metrics, piece by piece."""
    for job in jobs:
        for piece in job.results():
            yield job.name, piece
