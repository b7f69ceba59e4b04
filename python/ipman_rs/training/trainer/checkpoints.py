"""Checkpoints that are whole or not there: written beside their place and then moved; the last step has one, too."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import lightning
import torch
from lightning.pytorch.plugins.io import TorchCheckpointIO

from ipman_rs.files import being_written


class WholeFiles(TorchCheckpointIO):
    def save_checkpoint(self, checkpoint: dict[str, Any], path: Any, storage_options: Any = None) -> None:
        place = Path(path)
        place.parent.mkdir(parents=True, exist_ok=True)
        with being_written(place) as file:
            torch.save(checkpoint, file)


class AtEnd(lightning.Callback):
    """Saves the last step, which may be no multiple of those that are saved."""

    def __init__(self, place: Path, every: int) -> None:
        self.place, self.every = place, every

    def on_train_batch_end(self, trainer: lightning.Trainer, *_: Any, **__: Any) -> None:
        if trainer.global_step == trainer.max_steps and trainer.global_step % self.every:
            trainer.save_checkpoint(self.place)
