"""A seat: whoever sits has thighs that are near level, and feet below the knees,

    Σ_legs max(|h_hip − h_knee| − slack, 0)² + max(drop − (h_knee − h_ankle), 0)²     heights in metres

for the bodies that a seat holds up (`Problem.seated`). Where the seat is need not be known: it is wherever they sit.
"""

from __future__ import annotations

from collections.abc import Sequence

import torch
from torch import Tensor

from ipman_rs.checks import not_negative

from ...body.landmarks import SIDES
from ..candidate import Candidate
from ..problem import Problem
from ..support_points import NAMES, support_points
from .term import LeastSquares

LEGS = ("hip", "knee", "ankle")


class Seat(LeastSquares):
    """slack: metres that hip and knee may differ in height: seats are low and high, thighs thick. drop: metres from the
    knee down to the ankle, at least."""

    def __init__(self, problem: Problem, slack: float = 0.12, drop: float = 0.15):
        super().__init__(problem)
        if problem.ground is None:
            raise ValueError("ground: expected one for a seat; give it, or let a stage find it (find_ground)")
        self.slack, self.drop = not_negative("slack", slack), not_negative("drop", drop)
        self.landmarks = support_points(problem.body)
        self.places = [NAMES.index(f"{side}_{joint}") for joint in LEGS for side in SIDES]
        seated = torch.zeros(problem.num_bodies, dtype=torch.bool) if problem.seated is None else problem.seated
        self.weight = seated.double()[:, None]
        self.up = problem.ground.normal.double().reshape(-1, 3)

    def residuals(self, candidate: Candidate) -> Tensor:
        return self._outside(candidate.points_of(self.landmarks)[:, self.places])[0]

    def linearised(self, candidate: Candidate, free: Sequence[str]) -> tuple[Tensor, Tensor]:
        residuals, thigh, shank = self._outside(candidate.points_of(self.landmarks)[:, self.places])
        slopes = candidate.slopes_of(self.landmarks, free)[:, :, self.places]
        hips, knees, ankles = (slopes * self.up[:, None, None]).sum(dim=-1).split(2, dim=-1)
        return residuals, torch.cat([thigh[:, None] * (hips - knees), shank[:, None] * (ankles - knees)], dim=-1)

    def _outside(self, points: Tensor) -> tuple[Tensor, Tensor, Tensor]:
        """By how much each thigh and shank is off (B, 4), the sign with which hip minus knee changes that of the thighs
        (B, 2), and whether ankle minus knee changes that of the shanks; 0 within."""
        hips, knees, ankles = (points * self.up[:, None]).sum(dim=-1).split(2, dim=-1)
        steep = ((hips - knees).abs() - self.slack).clamp(min=0)
        raised = (self.drop - (knees - ankles)).clamp(min=0)
        outside = torch.cat([steep, raised], dim=-1)
        return self.weight * outside, self.weight * (hips - knees).sign() * (steep > 0), self.weight * (raised > 0)
