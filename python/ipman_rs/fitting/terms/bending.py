"""Bending the wrong way (SMPLify): Σ exp(±θ)² at knees and elbows, θ the angle of the hinge, radians.

In the zero pose a knee bends with positive x, a left elbow with negative y and a right one with positive y of their
rotation vectors; the signs are such that the cost of a hinge falls to 0 as it bends and grows as it overextends. Each
straight hinge costs 1.
"""

from __future__ import annotations

from torch import Tensor

from ..candidate import Candidate
from ..problem import Problem
from ..variables import pose_joints
from .term import LeastSquares

HINGES = {  # joint: axis, the sign of overextension
    "left_knee": (0, -1.0),
    "right_knee": (0, -1.0),
    "left_elbow": (1, 1.0),
    "right_elbow": (1, -1.0),
}


class Bending(LeastSquares):
    def __init__(self, problem: Problem):
        super().__init__(problem)
        names = pose_joints(problem.body.body)
        missing = [joint for joint in HINGES if joint not in names]
        if missing:
            raise ValueError(f"bending: expected a body with knees and elbows, this one has no {', '.join(missing)}")
        self.joints = [names.index(joint) for joint in HINGES]
        self.axes = [axis for axis, _ in HINGES.values()]
        self.signs = problem.body.v_template.new_tensor([sign for _, sign in HINGES.values()])

    def residuals(self, candidate: Candidate) -> Tensor:
        return (self.signs * candidate.variables["pose"][:, self.joints, self.axes]).exp()
