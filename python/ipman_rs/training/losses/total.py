"""All terms together: 60 · (5 L_2D + 5 L_3D + L_pose + 0.001 L_betas + L_scale + Σ λ L_physics), SPIN's weights.

It is the paper's Eq. 8. The λ of its terms stand inside the bracket, as in the authors' code: they count sixty times.
"""

from __future__ import annotations

from dataclasses import dataclass

import torch
from torch import Tensor, nn

from ..batch import Batch
from ..model import HMR, Estimate, keypoint_maps_loss
from ..posed_estimate import Posed, Posing
from ..projection import project
from .body_parameters import betas_loss, pose_loss
from .joints_3d import joints_3d_loss
from .keypoints_2d import keypoints_2d_loss
from .physics import PhysicsLoss
from .positive_scale import positive_scale_loss


@dataclass(frozen=True)
class Weights:
    """keypoint_maps: of `model.keypoint_maps_loss`, for the backbone "small". keypoints_2d_count: by how many keypoints
    L_2D is divided; 0: by those that are asked for (SPIN: 49)."""

    keypoints_2d: float = 5.0
    joints_3d: float = 5.0
    pose: float = 1.0
    betas: float = 0.001
    scale: float = 1.0
    keypoint_maps: float = 0.0
    all: float = 60.0
    keypoints_2d_count: int = 0


class Loss(nn.Module):
    """The training loss of an estimate; physics: None leaves its terms out (HMR*)."""

    def __init__(self, posing: Posing, physics: PhysicsLoss | None = None, weights: Weights | None = None) -> None:
        super().__init__()
        self.posing, self.physics, self.weights = posing, physics, weights or Weights()

    def forward(self, estimate: Estimate, batch: Batch) -> tuple[Tensor, dict[str, Tensor]]:
        """The weighted sum, and the unweighted terms, detached."""
        posed = self.posing(estimate)
        terms = self._data_terms(estimate, posed, batch)
        total = torch.stack([getattr(self.weights, name) * value for name, value in terms.items()]).sum()
        terms = {name: value.detach() for name, value in terms.items()}
        if self.physics is not None:
            physics, physics_terms = self.physics(posed, batch)
            total, terms = total + physics, terms | physics_terms
        return self.weights.all * total, terms

    def of(self, model: HMR, batch: Batch) -> tuple[Tensor, dict[str, Tensor]]:
        """The same of what a model estimates of the batch, and of its maps, where they have a weight."""
        weight = self.weights.keypoint_maps
        if weight == 0:
            return self(model(batch.inputs), batch)
        estimate, maps = model.with_maps(batch.inputs)
        total, terms = self(estimate, batch)
        maps_loss = keypoint_maps_loss(maps, batch.keypoints)
        return total + self.weights.all * weight * maps_loss, terms | {"keypoint_maps": maps_loss.detach()}

    def _data_terms(self, estimate: Estimate, posed: Posed, batch: Batch) -> dict[str, Tensor]:
        return {
            "keypoints_2d": keypoints_2d_loss(
                project(posed.keypoints, estimate.camera), batch.keypoints, self.weights.keypoints_2d_count
            ),
            # The regressor's joints come on top of the body's, but SPIN's mean is over 24, too.
            "joints_3d": joints_3d_loss(posed.all_joints, batch.joints, self.posing.hips, posed.joints.shape[1]),
            "pose": pose_loss(estimate.rotations, batch.pose, batch.has_body),
            "betas": betas_loss(estimate.betas, batch.betas, batch.has_body),
            "scale": positive_scale_loss(estimate.camera),
        }
