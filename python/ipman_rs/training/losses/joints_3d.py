"""Joints in three dimensions, about the middle of the hips."""

from __future__ import annotations

from collections.abc import Sequence

from torch import Tensor

from ..posed_estimate import HIPS


def joints_3d_loss(joints: Tensor, labels: Tensor, hips: Sequence[int] = HIPS, count: int | None = None) -> Tensor:
    """Σ c |x − x̂|² / (3 count) as a mean over the people who have labels of both hips; 0 if nobody has.

    joints (B, N, 3) m, labels (B, N, 4) with confidence c, in the same axes; both are centred at the hips. hips: the
    rows of hips, of one definition or of two, of which a person has labels of one. count: None for all N.
    """
    confidence = labels[..., 3]
    of_hips = (confidence[:, hips] > 0).to(joints.dtype)
    labelled = (of_hips.sum(dim=1) == 2).to(joints.dtype)
    error = _centred(joints, hips, of_hips) - _centred(labels[..., :3], hips, of_hips)
    of_people = (confidence * (error**2).mean(dim=-1)).sum(dim=1) / (count or joints.shape[1])
    return (labelled * of_people).sum() / labelled.sum().clamp(min=1)


def _centred(points: Tensor, hips: Sequence[int], weights: Tensor) -> Tensor:
    middle = (weights[..., None] * points[:, hips]).sum(dim=1) / weights.sum(dim=1).clamp(min=1)[:, None]
    return points - middle[:, None]
