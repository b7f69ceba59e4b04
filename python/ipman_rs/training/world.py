"""Estimated bodies in the world, where the ground is known.

The orientation follows from the camera, R_w = Rᵀ R_c. A crop does not determine to within centimetres where the
body stands, so, as in the authors' code, the middle of its hips is placed at the true one: the ground terms then
depend on the legs and the tilt, not on the depth. (The paper instead has t_w = −t_c + t_cw.)
"""

from __future__ import annotations

import torch
from torch import Tensor

import ipman_rs.torch as ipt

from .batch import Batch


def to_world(points: Tensor, hips: Tensor, batch: Batch) -> Tensor:
    """Points (B, N, 3) in the axes of the camera of the augmented image -> the world, `hips` (B, 3) on the true ones.

    Where the image was flipped this is the mirror image of the scene, across the world's plane x = 0.
    """
    origin = torch.zeros_like(hips)
    turned, _ = ipt.camera_to_world(
        points - hips[:, None], origin, batch.camera, origin, flip=batch.flip, rotation=batch.turn
    )
    side = torch.where(batch.flip[:, None], batch.hips.new_tensor([-1.0, 1.0, 1.0]), 1.0)
    return turned + (side * batch.hips)[:, None]


def world_to_camera(batch: Batch) -> Tensor:
    """World to camera (B, 3, 3) of the augmented images: of the mirrored world where they are flipped."""
    count = len(batch)
    origin = batch.camera.new_zeros(count, 3)
    axes = torch.eye(3, dtype=batch.camera.dtype, device=batch.camera.device).expand(count, 3, 3)
    turned, _ = ipt.camera_to_world(axes, origin, batch.camera, origin, flip=batch.flip, rotation=batch.turn)
    return turned.transpose(1, 2)
