"""Shape of a person whose height or mass is known (SMPLify-XMC):

    (Σ β²)² + e^(100 |Δheight|) − 1 + e^|Δmass| − 1     Δheight in m, Δmass in kg

of the body in its zero pose: height is its vertical extent, mass its volume × 985 kg/m³. The constants −1 are ours:
they move no minimum, and let tolerances relative to the cost mean something. Beyond `CAP` = 10 (10 cm, 10 kg) the
exponentials go on as straight lines of the same slope, so that a bad start overflows nothing.
"""

from __future__ import annotations

import math

import torch
from torch import Tensor

import ipman_rs.torch as ipt

from ..candidate import Candidate
from ..problem import Problem
from .term import Term

CAP = 10.0
DENSITY = 985.0  # kg/m³


class MeasuredShape(Term):
    def __init__(self, problem: Problem):
        super().__init__(problem)
        if problem.height is None and problem.mass is None:
            raise ValueError("measured_shape: expected a height or a mass, got neither")

    def cost(self, candidate: Candidate) -> Tensor:
        betas, body = candidate.variables["betas"], self.problem.body
        cost = betas.square().sum(dim=-1).square()
        vertices = body(betas=betas).vertices
        if self.problem.height is not None:
            up = vertices[..., 1]
            cost = cost + exponential(100.0 * (height(up) - self.problem.height).abs())
        if self.problem.mass is not None:
            mass = DENSITY * ipt.part_volumes(vertices, body.template).sum(dim=-1)
            cost = cost + exponential((mass - self.problem.mass).abs())
        return cost


def height(up: Tensor) -> Tensor:
    """Extent (B,) of coordinates (B, V)."""
    return up.max(dim=-1).values - up.min(dim=-1).values


def exponential(x: Tensor) -> Tensor:
    """e^x − 1, from CAP on a straight line."""
    return torch.expm1(x.clamp(max=CAP)) + math.exp(CAP) * (x - CAP).clamp(min=0)
