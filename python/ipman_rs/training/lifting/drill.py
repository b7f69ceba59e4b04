"""A training run in a loop of twenty lines: what is compared gets the same batches in the same order."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import torch

from ..batch import Batch
from ..losses import Loss
from ..model import HMR, Estimate
from .views import noisy


@dataclass(frozen=True)
class Drill:
    """steps of Adam on batches of `size`; the rate falls from `rate` to a tenth of it along half a cosine."""

    steps: int
    rate: float
    size: int = 64


def drill(model: HMR, loss: Loss, data: Batch, plan: Drill, seed: int, progress: Callable[[], None] | None = None):
    """Train in place. Which images a step draws, and their noise, depend on the seed and the step alone."""
    optimizer = torch.optim.Adam(model.parameters(), lr=plan.rate)
    schedule = torch.optim.lr_scheduler.CosineAnnealingLR(optimizer, plan.steps, eta_min=plan.rate / 10)
    generator = torch.Generator().manual_seed(seed)
    model.train()
    for _ in range(plan.steps):
        rows = torch.randint(len(data), (plan.size,), generator=generator)
        batch = noisy(data[rows], generator)
        total, _ = loss(model(batch.inputs), batch)
        optimizer.zero_grad()
        total.backward()
        optimizer.step()
        schedule.step()
        if progress is not None:
            progress()


@torch.no_grad()
def estimated(model: HMR, data: Batch, seed: int) -> Estimate:
    """Estimates of all images, from keypoints with the noise of a seed."""
    model.eval()
    return model(noisy(data, torch.Generator().manual_seed(seed)).inputs)
