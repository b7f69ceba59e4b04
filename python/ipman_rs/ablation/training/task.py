"""The tasks of the ablation: regression from keypoints (`from_keypoints.py`) or rendered images (`from_images.py`)."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any, BinaryIO, Protocol

import torch

from ...training.batch import Batch
from ...training.model import HMR
from ...training.posed_estimate import Posing
from ...training.train_loop import TrainingPlan

Progress = Callable[[int, int], None]  # how many of how many are made


@dataclass(frozen=True)
class Plan:
    """first: learning to see keypoints, once for each seed; None for none. base: training without physics, once for
    each seed and tilt. fine: what each row goes on with."""

    base: TrainingPlan
    fine: TrainingPlan
    first: TrainingPlan | None = None


class Task(Protocol):
    """A task is made once and may be sent to other processes."""

    @property
    def name(self) -> str:
        """Of the plan in settings.yaml, and of the page."""
        ...

    def trained_on(self) -> dict[str, Any]:
        """All that decides the data that is trained on, for the page and for the names of kept results."""
        ...

    def tested_on(self) -> dict[str, Any]:
        """The same of the data that figures are taken of."""
        ...

    def make(self, progress: Progress | None = None) -> None:
        """Draw or read the data, and keep them in files."""
        ...

    def fit_backbone(self, seed: int, plan: TrainingPlan, file: BinaryIO) -> None:
        """Learn to see keypoints; what `training` and `truth` need of it goes into a file."""
        ...

    def training(self, seen: Path | None) -> Batch:
        """The training set: keypoints, true labels. seen: the file of `fit_backbone`, if the plan has that stage."""
        ...

    def truth(self, seen: Path | None) -> Batch:
        """What figures are taken of: inputs as the regressor takes them, true labels, static people."""
        ...

    def noisy(self, batch: Batch, generator: torch.Generator) -> Batch:
        """Rows of `training` with inputs as the regressor takes them, with noise that is new at each step."""
        ...

    def lifting_network(self, seed: int) -> HMR:
        """The regressor from keypoints with the weights that a seed draws."""
        ...

    def posing(self) -> Posing: ...


def key_of(told: Any) -> str:
    """A short name of all that decides a result."""
    return hashlib.sha256(json.dumps(told, sort_keys=True).encode()).hexdigest()[:16]
