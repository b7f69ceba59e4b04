"""2D reprojection: how far the projected landmarks are from the points seen in the image, with the Geman-McClure cost

    Σ_k (w_k c_k)² ρ² e² / (e² + ρ²)     of each coordinate's error e in pixels of an image 500 pixels high

so that a point that was detected elsewhere (e ≫ ρ) stops pulling. Weight 1 is a mean of squares near zero error.
"""

from __future__ import annotations

from collections.abc import Mapping

import torch
from torch import Tensor

from ..candidate import Candidate
from ..problem import Problem
from .term import LeastSquares

HEIGHT = 500.0


class Reprojection(LeastSquares):
    """rho: pixels of an image 500 pixels high. weights: of landmarks by name, 1 where nothing is said."""

    def __init__(self, problem: Problem, rho: float = 100.0, weights: Mapping[str, float] | None = None):
        super().__init__(problem)
        if problem.points is None or problem.confidence is None or problem.image_size is None:
            raise ValueError("reprojection: expected points in an image, got none")
        self.rho = rho
        names = problem.landmarks.names
        self.points = problem.points
        self.scale = (HEIGHT / problem.image_size[:, 1])[:, None, None]
        weight = torch.tensor([(weights or {}).get(name, 1.0) for name in names], dtype=self.points.dtype)
        self.weight = (weight * problem.confidence)[..., None]

    def residuals(self, candidate: Candidate) -> Tensor:
        error = (candidate.projected - self.points) * self.scale
        return (self.weight * self.rho * error * (error.square() + self.rho**2).rsqrt()).flatten(1)
