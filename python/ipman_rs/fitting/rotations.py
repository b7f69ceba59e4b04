"""Rotation vectors, matrices and unit quaternions (x, y, z, w). Written out, because roma takes two seconds to load:
it brings torch's compiler with it. The tests hold it beside them."""

from __future__ import annotations

import torch
from torch import Tensor

__all__ = ["left_jacobian", "matrix", "nearest", "quaternion", "vector"]


def quaternion(rotations: Tensor) -> Tensor:
    """Unit quaternions (..., 4) of rotation vectors v (..., 3): v sin(θ/2)/θ and cos(θ/2); series for small θ."""
    square = rotations.square().sum(dim=-1, keepdim=True)
    small = square < 1e-4
    angle = torch.where(small, 1, square).sqrt()
    ratio = torch.where(small, 0.5 - square / 48 + square**2 / 3840, (angle / 2).sin() / angle)
    cosine = torch.where(small, 1 - square / 8 + square**2 / 384, (angle / 2).cos())
    return torch.cat([rotations * ratio, cosine], dim=-1)


def matrix(rotations: Tensor) -> Tensor:
    """Matrices (..., 3, 3) of rotation vectors (..., 3)."""
    x, y, z, w = quaternion(rotations).unbind(dim=-1)
    rows = [
        1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w),
        2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w),
        2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y),
    ]  # fmt: skip
    return torch.stack(rows, dim=-1).unflatten(-1, (3, 3))


def vector(matrices: Tensor) -> Tensor:
    """Rotation vectors (..., 3), no longer than π, of matrices (..., 3, 3)."""
    m = matrices.flatten(-2).unbind(dim=-1)
    # Four times the products of the quaternion's numbers, a row each; the row with the largest square is the soundest.
    rows = torch.stack([
        torch.stack([1 + m[0] - m[4] - m[8], m[1] + m[3], m[2] + m[6], m[7] - m[5]], dim=-1),
        torch.stack([m[1] + m[3], 1 - m[0] + m[4] - m[8], m[5] + m[7], m[2] - m[6]], dim=-1),
        torch.stack([m[2] + m[6], m[5] + m[7], 1 - m[0] - m[4] + m[8], m[3] - m[1]], dim=-1),
        torch.stack([m[7] - m[5], m[2] - m[6], m[3] - m[1], 1 + m[0] + m[4] + m[8]], dim=-1),
    ], dim=-2)  # fmt: skip
    largest = rows.diagonal(dim1=-2, dim2=-1).argmax(dim=-1)
    picked = rows.gather(-2, largest[..., None, None].expand(*largest.shape, 1, 4))[..., 0, :]
    q = picked / picked.square().sum(dim=-1, keepdim=True).sqrt()
    q = torch.where(q[..., 3:] < 0, -q, q)
    square = q[..., :3].square().sum(dim=-1, keepdim=True)
    small = square < 1e-8
    sine = torch.where(small, 1, square).sqrt()
    ratio = torch.where(small, 2 + square / 3, 4 * torch.atan(sine / (1 + q[..., 3:])) / sine)
    return ratio * q[..., :3]


def nearest(matrices: Tensor) -> Tensor:
    """The rotations nearest to matrices (..., 3, 3), by their singular values (Kabsch)."""
    left, _, right = torch.linalg.svd(matrices)
    sign = torch.ones_like(matrices[..., 0])
    sign[..., 2] = (torch.linalg.det(left) * torch.linalg.det(right)).sign()
    return (left * sign[..., None, :]) @ right


def left_jacobian(rotations: Tensor) -> Tensor:
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
