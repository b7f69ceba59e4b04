"""Self-contact: vertices inside another part of the body are pushed out of it, and those near one are pulled onto it.

    ½ Σ_inside tanh²(d / 0.04 m)  +  0.005 · ½ Σ_near tanh²(d / 0.005 m)

d the distance of a vertex to the nearest surface outside its own neighbourhood; sums over vertices, as in SMPLify-XMC.
"""

from __future__ import annotations

from torch import Tensor

import ipman_rs.torch as ipt

from ..candidate import Candidate
from ..problem import Problem
from .term import Term


class SelfContactTerm(Term):
    """Push and pull. Widths, near and geodesic in metres, as in `ipman_rs.torch.self_contact_loss`."""

    needs_mesh = True

    def __init__(
        self,
        problem: Problem,
        push_width: float = 0.04,
        pull_width: float = 0.005,
        pull_weight: float = 0.005,
        near: float = 0.02,
        geodesic: float = 0.3,
    ):
        super().__init__(problem)
        self.options = (push_width, pull_width, pull_weight, near, geodesic)

    def cost(self, candidate: Candidate) -> Tensor:
        push, pull = ipt.self_contact_loss(candidate.vertices, self.problem.body.template, *self.options)
        return push + pull


class SelfPenetrationTerm(Term):
    """Push alone."""

    needs_mesh = True

    def __init__(self, problem: Problem, width: float = 0.04, geodesic: float = 0.3):
        super().__init__(problem)
        self.width = width
        self.geodesic = geodesic

    def cost(self, candidate: Candidate) -> Tensor:
        push, _ = ipt.self_contact_loss(
            candidate.vertices, self.problem.body.template, self.width, near=0.0, geodesic=self.geodesic
        )
        return push
