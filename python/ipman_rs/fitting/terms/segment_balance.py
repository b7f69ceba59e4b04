"""Balance of segments: the body's centre of mass, from its joints alone, over what holds it up,

    max(d − r, 0)²     d: horizontal distance from the centre of mass to the line between the supports, metres

The line leads from foot to foot, of those that are down (`Problem.feet_down`), or from the seat to the feet if the
person sits (`Problem.seated`); r is half the length of a foot. The centre of mass is that of the segments of P. de
Leva, *Adjustments to Zatsiorsky-Seluyanov's segment inertia parameters*, J. Biomechanics 29 (1996), the mean of women
and men. This is what tells hypotheses about a photo apart before `balance` looks at the mesh of the best ones.
"""

from __future__ import annotations

from collections.abc import Sequence

import torch
from torch import Tensor

from ipman_rs.checks import positive

from ..candidate import Candidate
from ..problem import Problem
from ..support_points import NAMES, support_points
from .term import LeastSquares

# Share of the whole mass, the segment's two ends, and where between them its centre of mass lies; limbs on either side.
TRUNK = (("mid_hip", "neck", 0.430, 0.55), ("neck", "head", 0.068, 1.0))
LIMBS = (
    ("shoulder", "elbow", 0.0263, 0.58), ("elbow", "wrist", 0.0150, 0.46), ("wrist", "wrist", 0.0059, 0.0),
    ("hip", "knee", 0.1447, 0.39), ("knee", "ankle", 0.0457, 0.44), ("ankle", "big_toe", 0.0133, 0.4),
)  # fmt: skip
SUPPORTS = ("left_heel", "left_big_toe", "right_heel", "right_big_toe", "left_hip", "right_hip")
NEVER = 1e-9


class SegmentBalance(LeastSquares):
    """radius: metres. Bodies that are not static (`Problem.static`) cost nothing."""

    def __init__(self, problem: Problem, radius: float = 0.1):
        super().__init__(problem)
        if problem.ground is None:
            raise ValueError("ground: expected one for the balance of segments; give it, or let a stage find it")
        self.radius = positive("radius", radius)
        segments = [*TRUNK]
        segments += [
            (f"{side}_{a}", f"{side}_{b}", share, at) for side in ("left", "right") for a, b, share, at in LIMBS
        ]
        names = NAMES
        self.landmarks = support_points(problem.body)
        mass = torch.zeros(len(names), dtype=torch.float64)
        for a, b, share, at in segments:
            mass[names.index(a)] += share * (1 - at)
            mass[names.index(b)] += share * at
        bodies = problem.num_bodies
        down = torch.ones(bodies, 2, dtype=torch.bool) if problem.feet_down is None else problem.feet_down
        seated = torch.zeros(bodies, dtype=torch.bool) if problem.seated is None else problem.seated
        # The line's two ends, and the centre of mass, as weights of the points (B, 3, K).
        rows = torch.zeros(bodies, 3, len(names), dtype=torch.float64)
        rows[:, 0] = mass / mass.sum()
        feet = torch.zeros(2, len(names), dtype=torch.float64)
        for foot in range(2):
            feet[foot, [names.index(name) for name in SUPPORTS[2 * foot : 2 * foot + 2]]] = 0.5
        hips = torch.zeros(len(names), dtype=torch.float64)
        hips[[names.index(name) for name in SUPPORTS[4:]]] = 0.5
        left, right = down[:, :1].double(), down[:, 1:].double()
        neither = 1 - torch.maximum(left, right)
        left, right = left + neither, right + neither
        one = left * feet[0] + (1 - left) * feet[1]
        other = right * feet[1] + (1 - right) * feet[0]
        rows[:, 1] = torch.where(seated[:, None], hips, one)
        rows[:, 2] = torch.where(seated[:, None], (one + other) / 2, other)
        self.rows = rows
        static = torch.ones(bodies, dtype=torch.bool) if problem.static is None else problem.static
        self.weight = static.double()
        normal = problem.ground.normal.double().expand(bodies, 3)
        self.level = torch.eye(3, dtype=torch.float64) - normal[:, :, None] * normal[:, None, :]

    def residuals(self, candidate: Candidate) -> Tensor:
        return self._outside(self._three(candidate.points_of(self.landmarks)))[0]

    def linearised(self, candidate: Candidate, free: Sequence[str]) -> tuple[Tensor, Tensor]:
        """The line's nearest point moves as its ends do: by the envelope theorem its place on the line adds nothing."""
        places = self._three(candidate.points_of(self.landmarks))
        residuals, direction, share = self._outside(places)
        slopes = candidate.slopes_of(self.landmarks, free)  # (B, P, K, 3)
        along = (slopes * direction[:, None, None]).sum(dim=-1)  # (B, P, K)
        rows = self.rows[:, 0] - (1 - share)[:, None] * self.rows[:, 1] - share[:, None] * self.rows[:, 2]
        return residuals, (along * rows[:, None]).sum(dim=-1, keepdim=True)

    def _three(self, points: Tensor) -> Tensor:
        """Centre of mass and the line's ends (B, 3, 3), on the level."""
        three = (self.rows[..., None] * points[:, None]).sum(dim=2)
        return (self.level[:, None] * three[:, :, None]).sum(dim=-1)

    def _outside(self, three: Tensor) -> tuple[Tensor, Tensor, Tensor]:
        """How far the centre is outside (B, 1), the weighted direction (B, 3) of more, and where on the line (B,)."""
        centre, start, end = three.unbind(dim=1)
        line = end - start
        square = (line * line).sum(dim=-1)
        share = (((centre - start) * line).sum(dim=-1) / square.clamp(min=NEVER)).clamp(0, 1)
        away = centre - start - share[:, None] * line
        distance = (away * away).sum(dim=-1).clamp(min=NEVER**2).sqrt()
        outside = (distance - self.radius).clamp(min=0)
        weight = self.weight * (outside > 0)
        return (weight * outside)[:, None], (weight / distance)[:, None] * away, share.detach()
