"""The reduction of a batch's loss terms, in torch operations, for every path but `fused_loss`.

There the core does the same in the pass of the terms: `Pool` in rust/core/src/reduction.rs.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Literal, NamedTuple

import torch
from torch import Tensor

Reduction = Literal["mean", "sum", "none"]


class Pool(NamedTuple):
    """How the bodies of a batch are put together, and which of them may count."""

    reduction: Reduction
    batch_shape: torch.Size
    valid: Tensor | None
    """(B,) bool, None for all."""

    def shares(self, vertices: Tensor, weights: Sequence[float]) -> Tensor:
        """What each term of each body weighs in the total, if all valid bodies count: weights (K,) -> (B, K)."""
        if self.valid is None:
            if self.reduction == "mean":
                weights = [weight / max(len(vertices), 1) for weight in weights]
            return _row(vertices, weights).expand(len(vertices), len(weights))
        body = self.valid.to(vertices.dtype)
        if self.reduction == "mean":
            body = body / body.sum().clamp(min=1)
        return body[:, None] * _row(vertices, weights)

    def counted(self, values: Tensor) -> Tensor:
        """The bodies (B,) that are valid and whose values (B, K) are numbers: a broken body has NaN in all of them."""
        first = values.detach()[:, 0]
        finite = first == first
        return finite if self.valid is None else finite & self.valid

    def terms(self, values: Tensor, counted: Tensor) -> Tensor:
        """Values (B, K) of the bodies that count, reduced: (K,), or (..., K) where the reduction is "none"."""
        values = torch.where(counted[:, None], values, 0)
        if self.reduction == "none":
            return values.reshape(*self.batch_shape, values.shape[-1])
        total = values.sum(dim=0)
        return total / _number(counted, values) if self.reduction == "mean" else total

    def total(self, totals: Tensor, counted: Tensor) -> Tensor:
        """Totals (B,), weighted by `shares`, as one number, or (...) where the reduction is "none"."""
        totals = torch.where(counted, totals, 0)
        if self.reduction == "none":
            return totals.reshape(self.batch_shape)
        if self.reduction == "sum":
            return totals.sum()
        # A broken body is known only by its values, after the mean was shared out among all that are valid.
        shared = len(totals) if self.valid is None else self.valid.sum(dtype=totals.dtype)
        return totals.sum() * (shared / _number(counted, totals))


def mask(valid: Tensor, batch_shape: torch.Size, device: torch.device) -> Tensor:
    """valid (...) as bool (B,) on a device.

    Raises:
        ValueError: another shape or dtype.
        TypeError: it is no ordinary tensor.
    """
    if not isinstance(valid, Tensor) or valid.is_nested or valid.layout != torch.strided or valid.is_meta:
        raise TypeError(f"valid: expected an ordinary bool tensor, got {type(valid).__name__}")
    if valid.dtype != torch.bool or valid.shape != batch_shape:
        raise ValueError(
            f"valid: expected a bool tensor of shape {tuple(batch_shape)}, one a body, "
            f"got {valid.dtype} of shape {tuple(valid.shape)}"
        )
    return valid.reshape(-1).to(device)


def _number(counted: Tensor, values: Tensor) -> Tensor:
    """How many bodies count, at least 1, as a scalar that divides values."""
    return counted.sum(dtype=values.dtype).clamp(min=1)


def _row(like: Tensor, numbers: Sequence[float]) -> Tensor:
    """Numbers beside a tensor, filled in by kernels on devices: a copy from the host waits, and stops a CUDA graph."""
    if like.device.type == "cpu":
        return torch.tensor(numbers, dtype=like.dtype)  # new_tensor fails beside negative views
    return torch.stack([like.new_full((), number) for number in numbers])
