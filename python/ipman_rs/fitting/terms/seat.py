"""A seat: whoever sits has thighs that are near level, and knees about as high as the hips,

    Σ_legs max(|h_hip − h_knee| − slack, 0)²     heights in metres

for the bodies that a seat holds up (`Problem.seated`). Where the seat is need not be known: it is wherever they sit.
"""

from __future__ import annotations

from collections.abc import Sequence

import torch
from torch import Tensor

from ipman_rs.checks import not_negative

from ..candidate import Candidate
from ..problem import Problem
from ..support_points import NAMES, support_points
from .term import LeastSquares


class Seat(LeastSquares):
    """slack: metres that hip and knee may differ in height: seats are low and high, thighs thick."""

    def __init__(self, problem: Problem, slack: float = 0.12):
        super().__init__(problem)
        if problem.ground is None:
            raise ValueError("ground: expected one for a seat; give it, or let a stage find it (find_ground)")
        self.slack = not_negative("slack", slack)
        self.landmarks = support_points(problem.body)
        self.places = [NAMES.index(name) for name in ("left_hip", "right_hip", "left_knee", "right_knee")]
        seated = torch.zeros(problem.num_bodies, dtype=torch.bool) if problem.seated is None else problem.seated
        self.weight = seated.double()[:, None]
        self.up = problem.ground.normal.double().expand(problem.num_bodies, 3)

    def residuals(self, candidate: Candidate) -> Tensor:
        return self._outside(candidate.points_of(self.landmarks)[:, self.places])[0]

    def linearised(self, candidate: Candidate, free: Sequence[str]) -> tuple[Tensor, Tensor]:
        residuals, side = self._outside(candidate.points_of(self.landmarks)[:, self.places])
        slopes = candidate.slopes_of(self.landmarks, free)[:, :, self.places]
        heights = (slopes * self.up[:, None, None]).sum(dim=-1)
        return residuals, side[:, None] * (heights[..., :2] - heights[..., 2:])

    def _outside(self, points: Tensor) -> tuple[Tensor, Tensor]:
        """By how much each leg (B, 2) is steeper, and the sign with which hip minus knee changes that; 0 within."""
        heights = (points * self.up[:, None]).sum(dim=-1)
        difference = heights[:, :2] - heights[:, 2:]
        outside = (difference.abs() - self.slack).clamp(min=0)
        return self.weight * outside, self.weight * difference.sign() * (outside > 0)
