"""The paper's intuitive-physics terms, and this project's balance cost in place of stability, from the compiled core:

    stability   ‖g(CoM) − g(CoP)‖ (Eq. 4)                          m
    ground      mean of α1 tanh²(h/α2) over h ≥ 0, plus mean of β1 tanh²(h/β2) over h < 0 (Eqs. 5 to 7)
    balance     log(1 + J), see `ipman_rs.torch.balance_cost`       nats

with the constants of a preset of `ipman_rs.presets`. Terms of one preset share one evaluation.
"""

from __future__ import annotations

from collections.abc import Mapping
from functools import lru_cache
from typing import Any

import torch
from torch import Tensor

import ipman_rs.torch as ipt
from ipman_rs import BodyTemplate
from ipman_rs.body import BodyModel
from ipman_rs.checks import not_negative
from ipman_rs.quantities import Wrap

from ..candidate import Candidate
from ..problem import Problem
from .term import Term


class PhysicsTerm(Term):
    """preset: a name of `ipman_rs.presets`, `usual` if None.
    samples: of the body's surface, those of its template if None; fewer are faster and coarser.
    only_static: leave alone a body that was in the air or falling where the stage began (`problem.static`). Balance on
    the floor is not asked of a body that sits (`problem.seated`).
    """

    needs_mesh = True
    usual = "paper-o"
    quantities: tuple[str, ...]  # of IntuitivePhysicsLoss, summed
    factors: Mapping[str, float] = {}  # of the quantities, 1 where nothing is said
    wrap: Wrap = "log"  # of the balance cost
    needs_feet = True  # whether it asks the floor alone to hold the body up

    def __init__(
        self, problem: Problem, preset: str | None = None, samples: int | None = None, only_static: bool = False
    ):
        super().__init__(problem)
        if problem.ground is None:
            raise ValueError("ground: expected one for terms of physics; give it, or let a stage find it (find_ground)")
        self.loss = _loss(problem.body.body, preset or self.usual, samples, self.wrap)
        missing = set(self.quantities) - set(self.loss.terms)
        if missing:
            raise ValueError(f"preset: {preset!r} has {', '.join(self.loss.terms)}, but no {', '.join(missing)}")
        self.gate = problem.static if only_static else None
        if self.gate is not None and problem.seated is not None and self.needs_feet:
            self.gate = self.gate & ~problem.seated

    def cost(self, candidate: Candidate) -> Tensor:
        values = candidate.shared(self.loss, lambda: self.loss(candidate.vertices, self.problem.ground))
        parts = [self.factors.get(name, 1.0) * values[name] for name in self.quantities]
        total = torch.stack(parts, dim=-1).sum(dim=-1)
        return total if self.gate is None else torch.where(self.gate, total, 0)


class StabilityTerm(PhysicsTerm):
    quantities = ("stability",)


class GroundTerm(PhysicsTerm):
    """pull: a factor on that part. All that is within some 30 cm of the floor feels the pull, the soles alone the push:
    at 1 a body that is free to move comes to rest centimetres inside the floor."""

    quantities = ("pull", "push")
    needs_feet = False

    def __init__(self, problem: Problem, pull: float = 1.0, **options: Any):
        super().__init__(problem, **options)
        self.factors = {"pull": not_negative("pull", pull)}


class BalanceTerm(PhysicsTerm):
    """wrap: as in `balance_cost`; "saturate" lets a body that falls alone."""

    usual = "balanced"
    quantities = ("balance",)

    def __init__(self, problem: Problem, wrap: Wrap = "log", **options: Any):
        self.wrap = wrap
        super().__init__(problem, **options)


@lru_cache(maxsize=16)
def _loss(body: BodyModel, preset: str, samples: int | None, wrap: Wrap = "log") -> ipt.IntuitivePhysicsLoss:
    """One object for all terms of the same constants: by it they find each other's evaluation."""
    return ipt.IntuitivePhysicsLoss(_template(body, samples), preset=preset, reduction="none", wrap=wrap)


@lru_cache(maxsize=16)
def _template(body: BodyModel, samples: int | None) -> BodyTemplate:
    return body.template if samples is None else body.make_template(samples)
