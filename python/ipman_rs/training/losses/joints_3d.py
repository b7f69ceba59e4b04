"""Joints in three dimensions, about the middle of the hips."""

from __future__ import annotations

from torch import Tensor

HIPS = (1, 2)  # of SMPL's joints


def joints_3d_loss(joints: Tensor, labels: Tensor) -> Tensor:
    """Mean of c |x − x̂|² / 3 over the people who have labels of both hips, both centred there; 0 if nobody has.

    joints (B, J, 3) m, labels (B, J, 4) with confidence c, in the same axes.
    """
    confidence = labels[..., 3]
    labelled = (confidence[:, HIPS] > 0).all(dim=1).to(joints.dtype)
    error = _centred(joints) - _centred(labels[..., :3])
    of_people = (confidence * (error**2).mean(dim=-1)).mean(dim=1)
    return (labelled * of_people).sum() / labelled.sum().clamp(min=1)


def _centred(points: Tensor) -> Tensor:
    return points - points[:, HIPS].mean(dim=1, keepdim=True)
