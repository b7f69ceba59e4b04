"""The Lightning module: HMR, its loss, and its figures on each validation set."""

from __future__ import annotations

from typing import Any

import lightning
import numpy as np
import torch
from torch import Tensor

import ipman_rs.torch as ipt

from ..batch import Batch
from ..losses import Loss, PhysicsLoss
from ..metrics import COLUMNS, columns, pose_metrics
from ..model.build import build_model
from ..posed_estimate import Posing
from ..train_loop import clip_gradient, cosine_decay
from . import config, data


class Training(lightning.LightningModule):
    """Everything that a configuration decides."""

    def __init__(self, settings: config.TrainingConfig) -> None:
        super().__init__()
        self.settings = settings
        regressor = data.regressor(settings)
        posing = Posing(ipt.BodyModel(settings.body), data.keypoint_names(regressor is not None), regressor)
        self.body = posing.body.body
        with torch.random.fork_rng(devices=[]):
            torch.manual_seed(settings.seed)  # the same weights in every process
            self.model = build_model(settings, self.body)
        self.loss = Loss(posing, _physics(settings, posing), settings.loss)
        self._sums = torch.zeros(0)

    def on_save_checkpoint(self, checkpoint: dict[str, Any]) -> None:
        checkpoint["settings"] = config.as_dict(self.settings)

    def forward(self, inputs: Tensor):
        return self.model(inputs)

    def configure_optimizers(self):
        rate, steps = self.settings.rate, self.settings.steps
        optimizer = torch.optim.Adam(self.parameters(), lr=rate)
        if self.settings.schedule == "constant":
            return optimizer
        return {
            "optimizer": optimizer,
            "lr_scheduler": {"scheduler": cosine_decay(optimizer, rate, steps), "interval": "step"},
        }

    def train_dataloader(self):
        start = self.trainer.global_step
        return data.training_loader(self.settings, self.body, start, self.global_rank, self.trainer.world_size)

    def val_dataloader(self):
        return data.validation_loaders(self.settings, self.body, self.global_rank, self.trainer.world_size)

    def on_train_batch_start(self, batch: Batch, batch_idx: int) -> None:
        # Dropout depends only on the step and the process, so that a resumed run equals an uninterrupted one.
        seed = np.random.SeedSequence([self.settings.seed, self.global_step, self.global_rank])
        torch.manual_seed(int(seed.generate_state(1, np.uint64)[0] >> 1))

    def training_step(self, batch: Batch, batch_idx: int) -> dict[str, Any]:
        total, terms = self.loss.of(self.model, batch.sound())
        return {"loss": total, "terms": terms}

    def configure_gradient_clipping(self, optimizer: Any, *_: Any, **__: Any) -> None:
        clip_gradient(self, self.settings.clip)

    def on_validation_epoch_start(self) -> None:
        self._sums = torch.zeros(len(self.settings.validation), len(COLUMNS), 2, dtype=torch.float64)

    def validation_step(self, batch: Batch | None, batch_idx: int, dataloader_idx: int = 0) -> None:
        if batch is None:
            return
        batch = batch.sound()
        metrics = columns(
            pose_metrics(
                self.model(batch.inputs), batch, Posing(ipt.BodyModel(self.body), (), self.loss.posing.regressor)
            )
        )
        for number, key in enumerate(COLUMNS):
            values = torch.from_numpy(metrics[key][np.isfinite(metrics[key])])
            self._sums[dataloader_idx, number] += torch.tensor([values.sum(), len(values)], dtype=torch.float64)

    def on_validation_epoch_end(self) -> None:
        """Means over each set, of all processes, under the set's name; `PVE` alone is the first set's."""
        sums = self.trainer.strategy.reduce(self._sums.to(self.device), reduce_op="sum")
        assert isinstance(sums, Tensor)
        means = (sums[..., 0] / sums[..., 1]).cpu()
        for row, data_set in enumerate(self.settings.validation):
            for number, key in enumerate(COLUMNS):
                self.log(
                    f"{data_set.name}/{row}/{key}", means[row, number].float(), rank_zero_only=False, sync_dist=False
                )
        self.log("PVE", means[0, list(COLUMNS).index("PVE")].float())


def _physics(settings: config.TrainingConfig, posing: Posing) -> PhysicsLoss | None:
    physics = settings.physics
    if physics.preset == "none":
        return None
    return PhysicsLoss(posing.body.template, physics.preset, physics.weights, physics.counted)  # type: ignore[arg-type]
