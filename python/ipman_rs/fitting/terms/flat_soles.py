"""Flat soles: heels and toes of the feet that are down are where they are when the body stands flat on its ground,

    Σ_feet Σ_points ρ² d² / (d² + ρ²)     d = h − h₀, metres

h is the height of heel, big toe and small toe above the ground, and h₀ that of the zero pose, in which soles are flat.
So a sole is neither tilted nor above or below the floor; with ρ a foot that the image lifts or stands on its toes stops
pulling. Only the feet that `Problem.feet_down` names take part. Hands, elbows, knees, hips, shoulders and head that
`Problem.others_down` names touch the floor likewise, with the h₀ of `support_points.OTHERS`; then the soles are left
alone, for who kneels or does push-ups has no flat ones.
"""

from __future__ import annotations

from collections.abc import Sequence

import torch
from torch import Tensor

from ipman_rs.checks import positive

from ..candidate import Candidate
from ..problem import Problem
from ..support_points import NAMES, OTHERS, SOLE, SOLES, flat_heights, support_points
from .term import LeastSquares


class FlatSoles(LeastSquares):
    """rho: metres."""

    def __init__(self, problem: Problem, rho: float = 0.05):
        super().__init__(problem)
        if problem.ground is None:
            raise ValueError("ground: expected one for flat soles; give it, or let a stage find it (find_ground)")
        self.rho = positive("rho", rho)
        self.landmarks = support_points(problem.body)
        self.places = [NAMES.index(name) for name in (*SOLES, *OTHERS)]
        others = torch.tensor(list(OTHERS.values()), dtype=torch.float64)
        self.flat = torch.cat([flat_heights(problem.body.body), others])
        feet, more = problem.feet_down, problem.others_down
        feet = torch.ones(problem.num_bodies, 2, dtype=torch.bool) if feet is None else feet
        more = torch.zeros(problem.num_bodies, len(OTHERS), dtype=torch.bool) if more is None else more
        feet = feet & ~more.any(dim=1, keepdim=True)
        self.weight = torch.cat([feet.repeat_interleave(len(SOLE), dim=1), more], dim=1).double()

    def residuals(self, candidate: Candidate) -> Tensor:
        difference = self._heights(candidate) - self.flat
        return self.weight * self.rho * difference * torch.rsqrt(difference.square() + self.rho**2)

    def linearised(self, candidate: Candidate, free: Sequence[str]) -> tuple[Tensor, Tensor]:
        """h's derivative is the normal's share of the points'; that of ρ d / √(d² + ρ²) is (ρ / √(d² + ρ²))³."""
        difference = self._heights(candidate) - self.flat
        soft = self.rho * torch.rsqrt(difference.square() + self.rho**2)
        slopes = candidate.slopes_of(self.landmarks, free)[:, :, self.places]
        by_height = (slopes * self._normal(slopes)).sum(dim=-1)
        return self.weight * difference * soft, (self.weight * soft**3)[:, None] * by_height

    def _heights(self, candidate: Candidate) -> Tensor:
        """(B, K) m."""
        points = candidate.points_of(self.landmarks)[:, self.places]
        assert self.problem.ground is not None
        return (points * self._normal(points)).sum(dim=-1) - self.problem.ground.height.to(points).reshape(-1, 1)

    def _normal(self, like: Tensor) -> Tensor:
        """The ground's, with one axis of length 1 for each of the vectors' but the batch and the last."""
        assert self.problem.ground is not None
        normal = self.problem.ground.normal.to(like).expand(len(like), 3)
        return normal.reshape(len(like), *(1,) * (like.ndim - 2), 3)
