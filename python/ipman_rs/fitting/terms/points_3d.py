"""3D keypoints or markers: how far the landmarks are from the points measured in the world, metres,

Σ_k (w_k c_k)² |e_k|²                           without rho
Σ_k (w_k c_k)² ρ² |e_k|² / (|e_k|² + ρ²)        with it (Geman-McClure): a mislabelled marker stops pulling
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import torch
from torch import Tensor

from ipman_rs.checks import positive

from ..candidate import Candidate
from ..problem import Problem
from .term import LeastSquares


class Points3D(LeastSquares):
    """rho: metres, or None. weights: of landmarks by name, 1 where nothing is said."""

    def __init__(self, problem: Problem, rho: float | None = None, weights: Mapping[str, float] | None = None):
        super().__init__(problem)
        if problem.points_3d is None:
            raise ValueError("points_3d: expected points (B, K, 3) in the world, got none")
        self.rho = None if rho is None else positive("rho", rho)
        self.points = problem.points_3d
        names = problem.landmarks.names
        weight = self.points.new_tensor([(weights or {}).get(name, 1.0) for name in names])
        if problem.confidence_3d is not None:
            weight = weight * problem.confidence_3d
        self.weight = weight[..., None]

    def linearised(self, candidate: Candidate, free: Sequence[str]) -> tuple[Tensor, Tensor]:
        """e's derivative is the landmarks'; that of ρ e / √(|e|² + ρ²) has another share along e."""
        slopes = candidate.landmark_slopes(free)
        if self.rho is None:
            return self.residuals(candidate), (self.weight[:, None] * slopes).flatten(2)
        error = candidate.landmarks - self.points
        soft = torch.rsqrt(error.square().sum(dim=-1, keepdim=True) + self.rho**2)
        along = (slopes * error[:, None]).sum(dim=-1, keepdim=True)
        slopes = slopes - along * (error * soft**2)[:, None]
        return self.residuals(candidate), ((self.weight * self.rho * soft)[:, None] * slopes).flatten(2)

    def residuals(self, candidate: Candidate) -> Tensor:
        error = candidate.landmarks - self.points
        weight: Tensor = self.weight
        if self.rho is not None:
            x, y, z = error.unbind(-1)
            distance2 = (x * x + y * y + z * z)[..., None]
            weight = weight * self.rho * torch.rsqrt(distance2 + self.rho**2)
        return (weight * error).flatten(1)
