"""The terms of the training loss, one per file, and their sum with the weights of SPIN and of the paper."""

from ...renamed import old_names
from .body_parameters import betas_loss, pose_loss
from .joints_3d import joints_3d_loss
from .keypoints_2d import keypoints_2d_loss
from .physics import PhysicsLoss
from .positive_scale import positive_scale_loss
from .total import Loss, Weights

__all__ = [
    "Loss",
    "PhysicsLoss",
    "Weights",
    "betas_loss",
    "joints_3d_loss",
    "keypoints_2d_loss",
    "pose_loss",
    "positive_scale_loss",
]

__getattr__ = old_names(__name__, {"Physics": "PhysicsLoss"})
