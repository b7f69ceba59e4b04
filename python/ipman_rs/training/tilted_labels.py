"""Labels of bodies that are tilted, like those of pseudo labels; images, cameras and ground stay true.

A lean of d degrees turns the labelled body, parameters and joints, about a level axis through its pelvis by d ± 5/8 d
degrees (standard deviation, not below 0), drawn once per image. The lean is towards the camera, because fits to
images err in depth, and a regressor learns the error that all its labels share; or in any direction, which averages
out.
"""

from __future__ import annotations

import dataclasses
from typing import Literal

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor

from ipman_rs.body import rotations

from .batch import Batch
from .world import world_to_camera

Array = NDArray[np.floating]
TiltAxis = Literal["camera", "any"]

SPREAD = 5 / 8  # of the mean angle


def tilt_labels(batch: Batch, degrees: float, seed: int, lean: TiltAxis = "camera") -> Batch:
    """The batch with tilted labels. Image k draws the same numbers for every angle; 0 degrees change nothing."""
    if degrees == 0:
        return batch
    seen = world_to_camera(batch).double()
    up = batch.up.double()
    turn = seen @ torch.from_numpy(_turns(seen.numpy(), up.numpy(), degrees, lean, seed)) @ seen.transpose(1, 2)
    return dataclasses.replace(batch, pose=_turned_root(batch.pose, turn), joints=_turned(batch.joints, turn))


def _turns(seen: Array, up: Array, degrees: float, lean: TiltAxis, seed: int) -> Array:
    """(n, 3, 3) turns about level axes of the world, for cameras (n, 3, 3)."""
    draw = np.random.default_rng(seed)
    heading = draw.uniform(0, 2 * np.pi, len(seen))
    angle = np.radians((degrees * (1 + SPREAD * draw.standard_normal(len(seen)))).clip(min=0))
    # About `right`, what is up turns towards the camera, which looks along the third row.
    right = np.cross(seen[:, 2], up)
    right /= np.linalg.norm(right, axis=1, keepdims=True)
    axis = (
        right if lean == "camera" else np.cos(heading)[:, None] * right + np.sin(heading)[:, None] * np.cross(up, right)
    )
    return rotations.from_axis_angle(angle[:, None] * axis)


def _turned_root(pose: Tensor, turn: Tensor) -> Tensor:
    root = (turn @ pose[:, 0].double()).to(pose.dtype)
    return torch.cat([root[:, None], pose[:, 1:]], dim=1)


def _turned(joints: Tensor, turn: Tensor) -> Tensor:
    """Joints (B, J, 4) about the first, the pelvis."""
    pelvis = joints[:, :1, :3]
    moved = pelvis + (joints[..., :3] - pelvis) @ turn.transpose(1, 2).to(joints.dtype)
    return torch.cat([moved, joints[..., 3:]], dim=-1)
