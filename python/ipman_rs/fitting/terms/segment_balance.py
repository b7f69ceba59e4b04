"""Balance of segments: the body's centre of mass, from its joints alone, over what holds it up,

    max(d − r, 0)²     d: horizontal distance from the centre of mass to the hull of the supports, metres

Supports are the feet that are down (`Problem.feet_down`), the hips if the person sits (`Problem.seated`), and hands,
knees, hips, shoulders or head on the floor (`Problem.others_down`), each seen as a point; r is half the length of a
foot. The centre of mass is that of the segments of P. de Leva, *Adjustments to Zatsiorsky-Seluyanov's segment inertia
parameters*, J. Biomechanics 29 (1996), the mean of women and men. This is what tells hypotheses about a photo apart
before `balance` looks at the mesh of the best ones.
"""

from __future__ import annotations

from collections.abc import Sequence

import torch
from torch import Tensor

from ipman_rs.checks import positive

from ..candidate import Candidate
from ..problem import Problem
from ..support_points import NAMES, OTHERS, support_points
from .term import LeastSquares

# Share of the whole mass, the segment's two ends, and where between them its centre of mass lies; limbs on either side.
TRUNK = (("mid_hip", "neck", 0.430, 0.55), ("neck", "head", 0.068, 1.0))
LIMBS = (
    ("shoulder", "elbow", 0.0263, 0.58), ("elbow", "wrist", 0.0150, 0.46), ("wrist", "wrist", 0.0059, 0.0),
    ("hip", "knee", 0.1447, 0.39), ("knee", "ankle", 0.0457, 0.44), ("ankle", "big_toe", 0.0133, 0.4),
)  # fmt: skip
FEET = (("left_heel", "left_big_toe"), ("right_heel", "right_big_toe"))
HIPS = ("left_hip", "right_hip")
NEVER = 1e-9  # m, m²: nothing is so near


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
        self.landmarks = support_points(problem.body)
        mass = torch.zeros(len(NAMES), dtype=torch.float64)
        for a, b, share, at in segments:
            mass[NAMES.index(a)] += share * (1 - at)
            mass[NAMES.index(b)] += share * at
        self.mass = mass / mass.sum()
        self.sites = torch.stack([_middle(names) for names in (*FEET, HIPS, *((name,) for name in OTHERS))])
        self.down = _down(problem)
        pairs = torch.combinations(torch.arange(len(self.sites)), with_replacement=True)
        self.starts, self.ends = pairs.unbind(dim=1)
        static = torch.ones(problem.num_bodies, dtype=torch.bool) if problem.static is None else problem.static
        self.weight = static.double()
        normal = problem.ground.normal.double().reshape(-1, 3)
        self.level = torch.eye(3, dtype=torch.float64) - normal[:, :, None] * normal[:, None, :]

    def residuals(self, candidate: Candidate) -> Tensor:
        return self._outside(candidate.points_of(self.landmarks))[0]

    def linearised(self, candidate: Candidate, free: Sequence[str]) -> tuple[Tensor, Tensor]:
        """The hull's nearest point moves as its supports do: by the envelope theorem its place adds nothing."""
        residuals, direction, nearest = self._outside(candidate.points_of(self.landmarks))
        slopes = candidate.slopes_of(self.landmarks, free)  # (B, P, K, 3)
        along = (slopes * direction[:, None, None]).sum(dim=-1)  # (B, P, K)
        return residuals, (along * (self.mass - nearest)[:, None]).sum(dim=-1, keepdim=True)

    def _outside(self, points: Tensor) -> tuple[Tensor, Tensor, Tensor]:
        """How far the centre of mass of the points (B, K, 3) is outside (B, 1), the weighted direction (B, 3) of more,
        and the hull's nearest point as weights of the points (B, K)."""
        level = (self.level[:, None] * points[:, :, None]).sum(dim=-1)
        centre = (self.mass[:, None] * level).sum(dim=1)
        sites = (self.sites[:, :, None] * level[:, None]).sum(dim=2)
        # Of a point outside, the nearest point of the hull lies between two supports.
        start, line = sites[:, self.starts], sites[:, self.ends] - sites[:, self.starts]
        square = (line * line).sum(dim=-1)
        away = centre[:, None] - start
        share = ((away * line).sum(dim=-1) / square.clamp(min=NEVER)).clamp(0, 1)
        away = away - share[..., None] * line
        distances = (away * away).sum(dim=-1)
        there = self.down[:, self.starts] & self.down[:, self.ends]
        best = torch.where(there, distances.detach(), torch.inf).argmin(dim=1)
        rows = torch.arange(len(best))
        away, share = away[rows, best], share[rows, best].detach()
        nearest = centre - away
        # Inside, some support lies farther in that direction than the centre's own side.
        beyond = ((sites - nearest[:, None]) * away[:, None]).sum(dim=-1).detach()
        inside = (self.down & (beyond > NEVER)).any(dim=1)
        distance = distances[rows, best].clamp(min=NEVER**2).sqrt()
        outside = (distance - self.radius).clamp(min=0)
        weight = self.weight * (~inside & (outside > 0))
        place = (1 - share)[:, None] * self.sites[self.starts[best]] + share[:, None] * self.sites[self.ends[best]]
        return (weight * outside)[:, None], (weight / distance)[:, None] * away, place


def _middle(names: Sequence[str]) -> Tensor:
    """The middle of some points, as weights (K,) of all."""
    weights = torch.zeros(len(NAMES), dtype=torch.float64)
    weights[[NAMES.index(name) for name in names]] = 1 / len(names)
    return weights


def _down(problem: Problem) -> Tensor:
    """Which supports hold each body (B, S): both feet where nothing else does."""
    bodies = problem.num_bodies
    feet = torch.ones(bodies, 2, dtype=torch.bool) if problem.feet_down is None else problem.feet_down
    seated = torch.zeros(bodies, dtype=torch.bool) if problem.seated is None else problem.seated
    others = problem.others_down
    others = torch.zeros(bodies, len(OTHERS), dtype=torch.bool) if others is None else others
    nothing = ~(feet.any(dim=1) | seated | others.any(dim=1))
    return torch.cat([feet | nothing[:, None], seated[:, None], others], dim=1)
