"""Hand prior: Σ |θ|² of the hands' joints, radians.

These are the 30 finger joints of models that have them (relative to the mean hand that such a model adds by itself),
and the two joints `left_hand`, `right_hand` of 24-joint bodies.
"""

from __future__ import annotations

from torch import Tensor

from ipman_rs.body import joints

from ..candidate import Candidate
from ..problem import Problem
from .term import LeastSquares

HANDS = set(joints.SMPL + joints.SMPLH) - set(joints.BODY)


class HandPrior(LeastSquares):
    def __init__(self, problem: Problem):
        super().__init__(problem)
        names = problem.body.body.joint_names[1:]
        self.joints = [index for index, name in enumerate(names) if name in HANDS]
        if not self.joints:
            raise ValueError(f"hand_prior: expected a body with hand joints, got one with {', '.join(names)}")

    def residuals(self, candidate: Candidate) -> Tensor:
        return candidate.variables["pose"][:, self.joints].flatten(1)
