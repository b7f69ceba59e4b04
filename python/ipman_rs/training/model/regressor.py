"""The iterative regressor of HMR: features and the present parameters in, a correction of the parameters out."""

from __future__ import annotations

from dataclasses import dataclass

import torch
from torch import Tensor, nn

from .mean_parameters import MeanParameters

ROUNDS = 3


@dataclass(frozen=True)
class Estimate:
    """What is estimated of B people.

    pose (B, J, 6): the first two columns of each joint's rotation, not yet orthonormal, as `ipt.BodyModel` takes them;
    the root's turns into the axes of the camera. betas (B, b). camera (B, 3): what `projection.project` takes.
    """

    pose: Tensor
    betas: Tensor
    camera: Tensor

    @property
    def rotations(self) -> Tensor:
        """The joints' rotation matrices (B, J, 3, 3), by Gram-Schmidt."""
        first = nn.functional.normalize(self.pose[..., :3], dim=-1)
        second = self.pose[..., 3:]
        second = nn.functional.normalize(second - (first * second).sum(-1, keepdim=True) * first, dim=-1)
        return torch.stack([first, second, torch.linalg.cross(first, second)], dim=-1)


class Regressor(nn.Module):
    """Features (B, `features`) -> Estimate, in three rounds that share their layers.

    There is no activation between the layers, as in HMR and SPIN. Layers and buffers have the names of SPIN's
    checkpoints, and pose is kept in their order of numbers: the matrix (3, 2) of a joint row by row.
    """

    init_pose: Tensor
    init_shape: Tensor
    init_cam: Tensor

    def __init__(self, features: int, mean: MeanParameters, hidden: int = 1024, dropout: float = 0.5):
        super().__init__()
        self.joints = len(mean.pose)
        sizes = (6 * self.joints, len(mean.betas), 3)
        self.fc1 = nn.Linear(features + sum(sizes), hidden)
        self.drop1 = nn.Dropout(dropout)
        self.fc2 = nn.Linear(hidden, hidden)
        self.drop2 = nn.Dropout(dropout)
        self.decpose, self.decshape, self.deccam = (nn.Linear(hidden, size) for size in sizes)
        for layer in (self.decpose, self.decshape, self.deccam):
            nn.init.xavier_uniform_(layer.weight, gain=0.01)  # so that training starts at the mean
            nn.init.zeros_(layer.bias)
        interleaved = torch.as_tensor(mean.pose).reshape(-1, 2, 3).transpose(1, 2)
        self.register_buffer("init_pose", interleaved.reshape(1, -1).float())
        self.register_buffer("init_shape", torch.as_tensor(mean.betas)[None].float())
        self.register_buffer("init_cam", torch.as_tensor(mean.camera)[None].float())

    def forward(self, features: Tensor) -> Estimate:
        count = len(features)
        pose, shape, camera = (start.expand(count, -1) for start in (self.init_pose, self.init_shape, self.init_cam))
        for _ in range(ROUNDS):
            state = torch.cat([features, pose, shape, camera], dim=1)
            state = self.drop2(self.fc2(self.drop1(self.fc1(state))))
            pose, shape, camera = pose + self.decpose(state), shape + self.decshape(state), camera + self.deccam(state)
        columns = pose.reshape(count, self.joints, 3, 2).transpose(2, 3)
        return Estimate(columns.reshape(count, self.joints, 6), shape, camera)
