"""Presented pose (SMPLify-XMC): Σ |θ_j − θ̂_j|² of rotation vectors, radians, over the joints of the body.

Hands and face are left out: they have priors of their own.
"""

from __future__ import annotations

from torch import Tensor

from ipman_rs.body import joints

from ..candidate import Candidate
from ..problem import Problem
from ..variables import pose_joints
from .term import LeastSquares


class PresentedPose(LeastSquares):
    def __init__(self, problem: Problem):
        super().__init__(problem)
        if problem.presented is None:
            raise ValueError("presented_pose: expected a presented pose, got none")
        names = problem.body.body.joint_names[1:]
        pose = problem.presented.pose
        if pose.shape[-2:] != (len(names), 3):
            raise ValueError(
                f"presented_pose: expected (B, {len(names)}, 3), a row a joint without the root, "
                f"got {tuple(pose.shape)}"
            )
        moved = pose_joints(problem.body.body)
        shown = [name for name in moved if name in joints.BODY]
        self.joints = [moved.index(name) for name in shown]
        self.pose = pose[..., [names.index(name) for name in shown], :]

    def residuals(self, candidate: Candidate) -> Tensor:
        return (candidate.variables["pose"][:, self.joints] - self.pose).flatten(1)
