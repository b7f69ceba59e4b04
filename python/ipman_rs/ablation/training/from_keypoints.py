"""The ablation on a regressor from keypoints of static people, which trains in seconds."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any, BinaryIO

import torch

from ...synthetic import population
from ...training.batch import Batch
from ...training.lifting import network, views
from ...training.model import HMR
from ...training.posed_estimate import Posing
from ...training.train_loop import TrainingPlan
from .task import Progress

TRAINING = 31_000  # seeds: of the people that are trained on, and those whose figures are reported or tuned on
SPLITS = {"test": 38_000, "tune": 32_000}
VIEWS = 4  # of each person that is trained on


@dataclass(frozen=True)
class KeypointTask:
    """people: that are trained on. bodies: whose figures are taken, an image each. folder: where people are kept."""

    folder: Path
    people: int = 3500
    bodies: int = 2100
    split: str = "test"
    name: str = "keypoints"

    def trained_on(self) -> dict[str, Any]:
        return {
            "name": self.name, "people": self.people, "views": VIEWS, "seed": TRAINING, "placed_by": "hips",
        }  # fmt: skip

    def tested_on(self) -> dict[str, Any]:
        return {"split": self.split, "bodies": self.bodies, "test_seed": SPLITS[self.split]}

    def make(self, progress: Progress | None = None) -> None:
        count = self.people + self.bodies
        if progress is None:
            self._drawn(TRAINING, self.people)
            self._drawn(SPLITS[self.split], self.bodies)
        else:
            self._drawn(TRAINING, self.people, lambda done: progress(done, count))
            self._drawn(SPLITS[self.split], self.bodies, lambda done: progress(self.people + done, count))

    def fit_backbone(self, seed: int, plan: TrainingPlan, file: BinaryIO) -> None:
        """Nothing: keypoints are given."""

    def training(self, seen: Path | None = None) -> Batch:
        return views.views(self._drawn(TRAINING, self.people), TRAINING, VIEWS)

    def truth(self, seen: Path | None = None) -> Batch:
        seed = SPLITS[self.split]
        return self.noisy(views.views(self._drawn(seed, self.bodies), seed), torch.Generator().manual_seed(seed))

    def noisy(self, batch: Batch, generator: torch.Generator) -> Batch:
        return views.add_noise(batch, generator)

    def lifting_network(self, seed: int) -> HMR:
        return network.lifting_network(seed)

    def posing(self) -> Posing:
        return views.posing()

    def _drawn(self, seed: int, count: int, progress: Callable[[int], None] | None = None) -> population.Population:
        self.folder.mkdir(parents=True, exist_ok=True)
        path = self.folder / f"people-{seed}-{count}.npz"
        if not path.exists():
            population.draw_population(count, seed, progress).save(path)
        return population.Population.load(path)
