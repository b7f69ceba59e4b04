"""One training batch: inputs and labels; any label may be missing."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, fields

import torch
from torch import Tensor

import ipman_rs.torch as ipt


@dataclass(frozen=True, eq=False)
class Batch:
    """B people. Labels are as the augmented input shows them; camera, hips and ground are those of the world.

    "Camera axes" are x right, y down, z forward, of the camera that sees the augmented image.
    """

    inputs: Tensor  # (B, 3, H, W) images, or (B, K, 3) keypoints
    keypoints: Tensor  # (B, K, 3) x, y in half sides of the crop from its middle; confidence, 0 where not labelled
    joints: Tensor  # (B, J + R, 4) m, camera axes, about any origin; confidence; as in `Posed.all_joints`
    pose: Tensor  # (B, J, 3, 3) relative to the parent, the root's in camera axes
    betas: Tensor  # (B, b)
    has_body: Tensor  # (B,) bool: pose and betas are labelled

    camera: Tensor  # (B, 3, 3) world to camera, of the image before augmentation
    flip: Tensor  # (B,) bool: mirrored left to right, after the turn
    turn: Tensor  # (B,) radians by which the image was turned clockwise
    hips: Tensor  # (B, 3) m, their middle, in the world before augmentation
    regressed: Tensor  # (B,) bool: the hips are those that the regressor makes of vertices, not the body's joints
    up: Tensor  # (B, 3) the ground's normal
    height: Tensor  # (B,) m, of the ground along it
    has_world: Tensor  # (B,) bool: camera, hips and ground are known
    standing: Tensor  # (B,) bool: labelled as balanced
    contact: Tensor  # (B,) bool: labelled as touching the ground

    def __len__(self) -> int:
        return len(self.inputs)

    @classmethod
    def of(cls, samples: Sequence[Mapping[str, Tensor]]) -> Batch:
        """Samples {field: its row} stacked. KeyError, naming it, for a missing field."""
        names = [field.name for field in fields(cls)]
        return cls(**{name: torch.stack([sample[name] for sample in samples]) for name in names})

    def __getitem__(self, rows: Tensor | slice) -> Batch:
        return self._map(lambda value: value[rows])

    def to(self, device: torch.device | str, non_blocking: bool = False) -> Batch:
        return self._map(lambda value: value.to(device, non_blocking=non_blocking))

    @property
    def ground(self) -> ipt.Ground:
        return ipt.Ground.of_unit(self.up.double(), self.height.double())

    def sound(self) -> Batch:
        """The batch with labels that are not finite taken as missing; where an input is not finite, all of its labels.

        Training goes on; `~has_body` and confidences of 0 tell what was left out.
        """
        seen = _finite(self.inputs)
        body = self.has_body & seen & _finite(self.pose) & _finite(self.betas)
        world = self.has_world & seen & _finite(self.camera) & _finite(self.hips) & _finite(self.up)
        world = world & self.height.isfinite() & self.turn.isfinite()
        return dataclasses.replace(
            self,
            inputs=_cleared(self.inputs, seen),
            keypoints=_cleared(self.keypoints, seen[:, None] & self.keypoints.isfinite().all(dim=-1)),
            joints=_cleared(self.joints, seen[:, None] & self.joints.isfinite().all(dim=-1)),
            pose=_cleared(self.pose, body),
            betas=_cleared(self.betas, body),
            has_body=body,
            camera=_else(self.camera, world, torch.eye(3, dtype=self.camera.dtype, device=self.camera.device)),
            hips=_cleared(self.hips, world),
            up=_else(self.up, world, self.up.new_tensor([0.0, 1.0, 0.0])),
            height=_cleared(self.height, world),
            turn=_cleared(self.turn, world),
            has_world=world,
        )

    def _map(self, change) -> Batch:
        return Batch(**{field.name: change(getattr(self, field.name)) for field in fields(self)})


def _finite(value: Tensor) -> Tensor:
    """Which rows (B,) are finite throughout."""
    return value.isfinite().flatten(1).all(dim=1)


def _cleared(value: Tensor, keep: Tensor) -> Tensor:
    """The value with zeros where `keep`, of its leading dimensions, is false."""
    return _else(value, keep, torch.zeros((), dtype=value.dtype, device=value.device))


def _else(value: Tensor, keep: Tensor, other: Tensor) -> Tensor:
    return torch.where(keep.reshape(*keep.shape, *[1] * (value.ndim - keep.ndim)), value, other)
