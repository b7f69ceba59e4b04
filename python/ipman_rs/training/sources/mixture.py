"""Sources in given shares. Each sample is drawn from the run's seed and its own number, so step k of a run has the same
batch whether or not the run was interrupted, and however many processes share the work."""

from __future__ import annotations

import warnings
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from torch import Tensor
from torch.utils.data import Dataset, Sampler

from .source import BadSample, Source

TRIES = 50  # samples in a row that may be bad


@dataclass(frozen=True)
class Share:
    """A source and its share of the samples."""

    name: str
    source: Source
    share: float = 1.0


class Mixture(Dataset):
    """Sample number n: a source by its share, a row of it, and an augmentation, drawn from (seed, n).

    A bad sample is warned of once, and another is drawn in its place. ValueError: no source, an empty one, a share that
    is not positive, or too many bad samples in a row.
    """

    def __init__(self, shares: Sequence[Share], seed: int = 0) -> None:
        if not shares:
            raise ValueError("data: expected at least one data set to train on, got none")
        for share in shares:
            if not len(share.source):
                raise ValueError(f"data: {share.name} is empty")
            if not share.share > 0:
                raise ValueError(f"data: {share.name}: expected a share above 0, got {share.share}")
        self.shares, self.seed = tuple(shares), seed
        weights = np.array([share.share for share in shares], float)
        self._ends = np.cumsum(weights / weights.sum())
        self._bad: set[str] = set()

    def __getitem__(self, number: int) -> dict[str, Tensor]:
        draw = np.random.default_rng([self.seed, number])
        message = ""
        for _ in range(TRIES):
            # By the last end's rounding a draw may lie beyond it.
            chosen = self.shares[
                min(int(np.searchsorted(self._ends, draw.random(), side="right")), len(self.shares) - 1)
            ]
            row = int(draw.integers(len(chosen.source)))
            try:
                return chosen.source.sample(row, draw)
            except BadSample as error:
                message = f"{chosen.name}: {error}"
                if message not in self._bad:
                    self._bad.add(message)
                    warnings.warn(f"skipped: {message}", stacklevel=2)
        raise ValueError(f"data: {TRIES} bad samples in a row, the last: {message}")


class Steps(Sampler[list[int]]):
    """The numbers of each step's samples, from step `start` to `stop`.

    A step has `size` · `processes` samples, of which process `rank` takes its `size`: two processes see in a step what
    one sees with twice the size.
    """

    def __init__(self, start: int, stop: int, size: int, rank: int = 0, processes: int = 1) -> None:
        self.start, self.stop, self.size, self.rank, self.processes = start, stop, size, rank, processes

    def __len__(self) -> int:
        return self.stop  # all steps of the run: those before `start` are done

    def __iter__(self) -> Iterator[list[int]]:
        for step in range(self.start, self.stop):
            first = (step * self.processes + self.rank) * self.size
            yield list(range(first, first + self.size))
