"""Checkpoints that are complete or absent: written under a temporary name and then moved."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import lightning
import torch
from lightning.pytorch.callbacks import Checkpoint
from lightning.pytorch.plugins.io import TorchCheckpointIO

from ipman_rs.files import atomic_write


class WholeFiles(TorchCheckpointIO):
    def save_checkpoint(self, checkpoint: dict[str, Any], path: Any, storage_options: Any = None) -> None:
        place = Path(path)
        place.parent.mkdir(parents=True, exist_ok=True)
        with atomic_write(place) as file:
            torch.save(checkpoint, file)


class LastCheckpoint(Checkpoint):
    """The checkpoint from which an interrupted run continues: of every `every`-th step and of the last.

    A step that is validated (every `validated`-th, none where 0) is saved after its validation: a run that goes on from
    it does not validate it again. As a `Checkpoint` it is called after all other callbacks, and last of these.
    """

    def __init__(self, place: Path, every: int, validated: int) -> None:
        self.place, self.every, self.validated = place, every, validated

    def on_train_batch_end(self, trainer: lightning.Trainer, *_: Any, **__: Any) -> None:
        if not (self.validated and trainer.global_step % self.validated == 0):
            self._save(trainer)

    def on_validation_end(self, trainer: lightning.Trainer, *_: Any) -> None:
        self._save(trainer)

    def _save(self, trainer: lightning.Trainer) -> None:
        if trainer.global_step % self.every == 0 or trainer.global_step == trainer.max_steps:
            trainer.save_checkpoint(self.place, weights_only=False)
