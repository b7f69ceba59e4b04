"""Pose and shape parameters against labelled ones."""

from __future__ import annotations

from torch import Tensor


def pose_loss(rotations: Tensor, labels: Tensor, labelled: Tensor) -> Tensor:
    """Mean squared difference of rotation matrices (B, J, 3, 3) over the people `labelled` (B,); 0 if nobody is."""
    return _mean_square(rotations - labels, labelled)


def betas_loss(betas: Tensor, labels: Tensor, labelled: Tensor) -> Tensor:
    """Mean squared difference of betas (B, b) over the people `labelled` (B,); 0 if nobody is."""
    return _mean_square(betas - labels, labelled)


def _mean_square(difference: Tensor, labelled: Tensor) -> Tensor:
    weights = labelled.to(difference.dtype)
    return (weights * (difference**2).flatten(1).mean(dim=1)).sum() / weights.sum().clamp(min=1)
