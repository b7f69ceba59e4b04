"""Rotation vectors, matrices and unit quaternions (x, y, z, w): roma's, under the names used here."""

from __future__ import annotations

import torch
from roma import procrustes
from roma import rotmat_to_rotvec as vector
from roma import rotvec_to_rotmat as matrix
from roma import rotvec_to_unitquat as quaternion

__all__ = ["left_jacobian", "matrix", "nearest", "quaternion", "vector"]


def nearest(matrices: torch.Tensor) -> torch.Tensor:
    """The rotations nearest to matrices (..., 3, 3)."""
    rotations = procrustes(matrices, force_rotation=True, method="svd")
    assert isinstance(rotations, torch.Tensor)
    return rotations


def left_jacobian(rotations: torch.Tensor) -> torch.Tensor:
    """J (..., 3, 3) of rotation vectors v (..., 3): v + d turns as v does and then by J d.

    J = I + (1 − cos θ)/θ² [v]× + (θ − sin θ)/θ³ [v]×², by its series for small θ.
    """
    x, y, z = rotations.unbind(-1)
    square = x * x + y * y + z * z
    small = square < 1e-4
    angle = torch.where(small, 1, square).sqrt()
    b = torch.where(small, 0.5 - square / 24 + square**2 / 720, (1 - angle.cos()) / angle**2)
    c = torch.where(small, 1 / 6 - square / 120 + square**2 / 5040, (angle - angle.sin()) / angle**3)
    zero = torch.zeros_like(x)
    rows = torch.stack([zero, -z, y, z, zero, -x, -y, x, zero], dim=-1).unflatten(-1, (3, 3))
    squared = rotations[..., :, None] * rotations[..., None, :] - square[..., None, None] * torch.eye(3).to(rows)
    return torch.eye(3).to(rows) + b[..., None, None] * rows + c[..., None, None] * squared
