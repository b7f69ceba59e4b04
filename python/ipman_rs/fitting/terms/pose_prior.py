"""Pose prior: Σ ((θ − μ) / σ)², a Gaussian over rotation vectors, each number by itself.

Made here, of no recorded data: σ is a quarter of the joint's range (`joint_limits.RANGES`, so that the range is ±2σ
wide) and 5° at least; μ is a relaxed person, arms half lowered, hips, knees and elbows slightly bent, and 0 elsewhere.
Its weight is that of a negative log likelihood times 2: a weight of 1 is right beside residuals in standard deviations.
"""

from __future__ import annotations

from collections.abc import Sequence

import torch
from torch import Tensor

from ipman_rs.body import BodyModel, joints
from ipman_rs.checks import positive

from ..candidate import Candidate
from ..problem import Problem
from ..variables import diagonal, pose_joints
from .joint_limits import range_of
from .term import LeastSquares

# Degrees about x, y, z, of the left side.
MEANS = {"hip": (-20, 0, 0), "knee": (25, 0, 0), "shoulder": (0, -15, -45), "elbow": (0, -30, 0)}
NARROWEST = 5.0


class PosePrior(LeastSquares):
    """width: a factor on every σ. Joints that are not SMPL's (fingers, jaw) have no prior here."""

    def __init__(self, problem: Problem, width: float = 1.0):
        super().__init__(problem)
        width = positive("width", width, "numbers")
        there = pose_joints(problem.body.body)
        names = [name for name in there if name in joints.SMPL]
        if not names:
            raise ValueError("pose_prior: expected a body with SMPL's joints, this one has none of them")
        self.joints = [there.index(name) for name in names]
        like = problem.body.v_template
        ranges = like.new_tensor([range_of(name) for name in names])
        self.mean = like.new_tensor([mean_of(name) for name in names]).deg2rad()
        self.deviation = width * ((ranges[..., 1] - ranges[..., 0]) / 4).clamp(min=NARROWEST).deg2rad()

    def residuals(self, candidate: Candidate) -> Tensor:
        return ((candidate.variables["pose"][:, self.joints] - self.mean) / self.deviation).flatten(1)

    def linearised(self, candidate: Candidate, free: Sequence[str]) -> tuple[Tensor, Tensor]:
        pose, residuals = candidate.variables["pose"], self.residuals(candidate)
        weights = torch.zeros_like(pose)
        weights[:, self.joints] = (1 / self.deviation).to(pose)
        everywhere = diagonal(weights.flatten(1), "pose", candidate.variables, free)
        numbers = [3 * joint + axis for joint in self.joints for axis in range(3)]
        return residuals, everywhere[..., numbers]


def mean_pose(body: BodyModel) -> Tensor:
    """The mean (J, 3), radians, of all joints of a body; 0 for those without a prior."""
    rows = [mean_of(name) if name in joints.SMPL[1:] else (0.0, 0.0, 0.0) for name in body.joint_names]
    return torch.tensor(rows, dtype=torch.float64).deg2rad()


def mean_of(name: str) -> tuple[float, float, float]:
    """Degrees; the right side mirrors y and z."""
    side, _, joint = name.partition("_")
    x, y, z = MEANS.get(joint, (0, 0, 0))
    return (x, -y, -z) if side == "right" else (x, y, z)
