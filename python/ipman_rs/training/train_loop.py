"""A training loop for ablations: all compared runs see identical batches in the same order."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import torch
from torch import Tensor, nn

from .batch import Batch
from .model import HMR, Estimate

Noisy = Callable[[Batch, torch.Generator], Batch]
AT_ONCE = 100  # images of an estimate
# Of the gradient: the first steps reach 3,000, later ones hundreds; where a camera's scale passes zero, projections and
# gradients explode, and training would not recover.
LARGEST = 5000.0


@dataclass(frozen=True)
class TrainingPlan:
    """steps of Adam on batches of `size`; the rate falls from `rate` to a tenth of it along half a cosine."""

    steps: int
    rate: float
    size: int = 64


def run_plan(
    model: nn.Module, loss: Callable[[Batch], Tensor], data: Batch, noisy: Noisy, plan: TrainingPlan, seed: int
) -> None:
    """Train the model in place. A step's images and their noise depend only on the seed and the step."""
    optimizer = torch.optim.Adam(model.parameters(), lr=plan.rate)
    schedule = cosine_decay(optimizer, plan.rate, plan.steps)
    generator = torch.Generator().manual_seed(seed)
    model.train()
    for _ in range(plan.steps):
        rows = torch.randint(len(data), (plan.size,), generator=generator)
        batch = noisy(data[rows], generator)
        optimizer.zero_grad()
        loss(batch).backward()
        clip_gradient(model, LARGEST)
        optimizer.step()
        schedule.step()


def clip_gradient(model: nn.Module, largest: float) -> None:
    """To a norm of `largest`. One that is not finite, of a projection that passed through infinity, is dropped: no
    optimizer moves weights without a gradient, and with it they would all be NaN."""
    if not torch.nn.utils.clip_grad_norm_(model.parameters(), largest).isfinite():
        model.zero_grad(set_to_none=True)


def cosine_decay(
    optimizer: torch.optim.Optimizer, rate: float, steps: int
) -> torch.optim.lr_scheduler.CosineAnnealingLR:
    """From `rate` to a tenth of it along half a cosine, in `steps`."""
    return torch.optim.lr_scheduler.CosineAnnealingLR(optimizer, steps, eta_min=rate / 10)


@torch.no_grad()
def estimate_all(model: HMR, inputs: Tensor) -> Estimate:
    """Estimates of all inputs."""
    model.eval()
    parts = [model(part) for part in inputs.split(AT_ONCE)]
    return Estimate(
        *(torch.cat(columns) for columns in zip(*((e.pose, e.betas, e.camera) for e in parts), strict=True))
    )
