"""What a fit may move: named blocks of numbers, a row a body, and the vector of the free ones that a solver sees.

orient (B, 3)          the root's rotation vector, in the world
pose (B, J − 1, 3)     rotation vectors of the other joints, each relative to its parent
betas (B, b)           shape
transl (B, 3)          m, added to the posed body, in the world
camera_orient (B, 3)   rotation vector of the camera's extrinsics R, world to camera
camera_transl (B, 3)   m, their t: X_c = R X_w + t
log_focal (B, 2)       fx and fy, as logarithms of their ratio to the camera's own
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

import torch
from torch import Tensor

BLOCKS = ("orient", "pose", "betas", "transl", "camera_orient", "camera_transl", "log_focal")
Variables = Mapping[str, Tensor]


def pack(variables: Variables, free: Sequence[str]) -> Tensor:
    """The free blocks as rows (B, P)."""
    return torch.cat([variables[name].flatten(1) for name in free], dim=1)


def unpack(rows: Tensor, free: Sequence[str], rest: Variables) -> dict[str, Tensor]:
    """All blocks: the free ones from their rows (B, P), the others from `rest`."""
    sizes = [math.prod(rest[name].shape[1:]) for name in free]
    parts = zip(free, rows.split(sizes, dim=1), strict=True)
    return {**rest, **{name: part.reshape(-1, *rest[name].shape[1:]) for name, part in parts}}


def diagonal(weights: Tensor, block: str, variables: Variables, free: Sequence[str]) -> Tensor:
    """The Jacobian (B, P, R) by the free blocks of residuals that are weights (B, R) times the numbers of one block."""
    rows = torch.diag_embed(weights)
    sizes = {name: math.prod(variables[name].shape[1:]) for name in free}
    parts = [rows if name == block else rows.new_zeros(len(rows), size, rows.shape[2]) for name, size in sizes.items()]
    return torch.cat(parts, dim=1)
