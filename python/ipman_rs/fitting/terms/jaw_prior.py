"""Jaw prior (SMPLify-X): Σ (a_k θ_k)² of the jaw's rotation vector, radians; 0 for bodies without a jaw.

a are factors about x, y, z: a jaw opens about x, and does not turn or tilt.
"""

from __future__ import annotations

from collections.abc import Sequence

from torch import Tensor

from ..candidate import Candidate
from ..problem import Problem
from ..variables import face_joints
from .term import LeastSquares


class JawPrior(LeastSquares):
    """axes: the three factors a."""

    def __init__(self, problem: Problem, axes: Sequence[float] = (1.0, 10.0, 10.0)):
        super().__init__(problem)
        if len(axes) != 3:
            raise ValueError(f"jaw_prior: axes: expected three factors, got {list(axes)}")
        names = face_joints(problem.body.body)
        self.joints = [names.index("jaw")] if "jaw" in names else []
        self.axes = problem.body.v_template.new_tensor(axes)

    def residuals(self, candidate: Candidate) -> Tensor:
        return (self.axes * candidate.variables["face"][:, self.joints]).flatten(1)
