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
    """first: training of the backbone on keypoints, once for each seed; None for none. base: training without physics,
    once for each seed and tilt. fine: the fine-tuning of each row."""

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
        """The settings that determine the training data, for the page and for the names of saved results."""
        ...

    def tested_on(self) -> dict[str, Any]:
        """The settings that determine the test data."""
        ...

    def make(self, progress: Progress | None = None) -> None:
        """Draw or read the data, and save them in files."""
        ...

    def fit_backbone(self, seed: int, plan: TrainingPlan, file: BinaryIO) -> None:
        """Train the backbone to detect keypoints; the file gets what `training` and `truth` need of it."""
        ...

    def training(self, seen: Path | None) -> Batch:
        """The training set: keypoints, true labels. seen: the file of `fit_backbone`, if the plan has that stage."""
        ...

    def truth(self, seen: Path | None) -> Batch:
        """The test set: inputs of the regressor, true labels, static people."""
        ...

    def noisy(self, batch: Batch, generator: torch.Generator) -> Batch:
        """Rows of `training` with inputs as the regressor takes them, with noise that is new at each step."""
        ...

    def lifting_network(self, seed: int) -> HMR:
        """The regressor from keypoints with the weights that a seed draws."""
        ...

    def posing(self) -> Posing: ...


def key_of(settings: Any) -> str:
    """A short hash of the settings that determine a result."""
    return hashlib.sha256(json.dumps(settings, sort_keys=True).encode()).hexdigest()[:16]
