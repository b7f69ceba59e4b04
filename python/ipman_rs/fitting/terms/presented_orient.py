"""Presented orientation (SMPLify-XMC's GlobalOrientLoss): the body turns about the vertical alone,

    1e-4 (Δx⁴ + Δz⁴)     Δ in degrees, the short way round

Δx and Δz are how far the root's angles about x and z are from the presented ones, where its rotation is
R_z(z) R_y(y) R_x(x).
"""

from __future__ import annotations

import math

import torch
from torch import Tensor

from ..candidate import Candidate
from ..problem import Problem
from ..rotations import matrix
from .term import LeastSquares

LOCKED = 1e-4  # cos² y below which x and z are the same turn


class PresentedOrient(LeastSquares):
    def __init__(self, problem: Problem):
        super().__init__(problem)
        if problem.presented is None:
            raise ValueError("presented_orient: expected a presented pose, got none")
        shown = problem.presented.orient
        if shown is None:
            shown = problem.presented.pose.new_zeros(len(problem.presented.pose), 3)
        self.cosines, self.sines = about_x_and_z(matrix(shown))

    def residuals(self, candidate: Candidate) -> Tensor:
        cosines, sines = about_x_and_z(matrix(candidate.variables["orient"]))
        away = angle(cosines * self.cosines + sines * self.sines, sines * self.cosines - cosines * self.sines)
        return 1e-2 * away.rad2deg().square()


def about_x_and_z(rotation: Tensor) -> tuple[Tensor, Tensor]:
    """Cosines and sines (..., 2), by one factor too large, of the angles about x and z of matrices (..., 3, 3); z is 0
    where y is a right angle."""
    (xx, _, _), (yx, yy, yz), (_, zy, zz) = (row.unbind(-1) for row in rotation.unbind(-2))
    locked = xx.square() + yx.square() < LOCKED
    one = torch.ones_like(xx)
    cosines = torch.stack([torch.where(locked, yy, zz), torch.where(locked, one, xx)], dim=-1)
    sines = torch.stack([torch.where(locked, -yz, zy), torch.where(locked, 0 * one, yx)], dim=-1)
    return cosines, sines


def angle(cosine: Tensor, sine: Tensor) -> Tensor:
    """Radians, −π to π, from cosine and sine times any factor. With an arctangent of half the angle: torch's atan2
    rounds by where in its vector registers a number lies."""
    length = (cosine.square() + sine.square()).sqrt()
    back = length + cosine <= 1e-9 * length
    half = torch.where(back, 0, sine) / torch.where(back, 1, length + cosine)
    return torch.where(back, math.pi, 2 * torch.atan(half))
