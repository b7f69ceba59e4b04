"""The paper's intuitive-physics terms, and this project's balance cost in place of stability, from the compiled core:

    stability   ‖g(CoM) − g(CoP)‖                                  m
    ground      mean of α1 tanh²(h/α2) over h ≥ 0, plus mean of β1 tanh²(h/β2) over h < 0
    balance     log(1 + J), see `ipman_rs.torch.balance_cost`       nats

with the constants of a preset of `ipman_rs.presets`. Terms of one preset share one evaluation.
"""

from __future__ import annotations

from functools import lru_cache

import torch
from torch import Tensor

import ipman_rs.torch as ipt

from .. import switch
from ..candidate import Candidate
from ..problem import Problem
from .term import Term


class Physics(Term):
    """samples: of the body's surface, those of its template if None; fewer are faster and coarser.

    only_static: leave alone a body that, where the stage begins, is in the air or falling (`fitting.switch`): its cost is
    0 until the next stage.
    """

    needs_mesh = True

    def __init__(self, problem: Problem, preset: str = "paper-o", samples: int | None = None, only_static: bool = False):
        super().__init__(problem)
        self.loss = _loss(problem.body.template, preset, samples)
        self.only_static = only_static
        self.gate: Tensor | None = None

    def begin(self, candidate: Candidate) -> None:
        if self.only_static:
            self.gate = candidate.shared(
                (switch.static, self.loss.template),
                lambda: switch.static(candidate.vertices, self.loss.template, self.problem.ground),
            )

    def value(self, candidate: Candidate, *names: str) -> Tensor:
        """(B,), the sum of the named quantities of bodies that are not left alone."""
        if self.only_static and self.gate is None:
            self.begin(candidate)
        values = candidate.shared(self.loss, lambda: self.loss(candidate.vertices, self.problem.ground))
        total = values[names[0]]
        for name in names[1:]:
            total = total + values[name]
        return total if self.gate is None else torch.where(self.gate > 0, total, 0)


class Stability(Physics):
    def __init__(self, problem: Problem, preset: str = "paper-o", samples: int | None = None, only_static: bool = False):
        super().__init__(problem, preset, samples, only_static)
        if "stability" not in self.loss.terms:
            raise ValueError(f"stability: preset {preset!r} has a balance cost in its place; use the term balance")

    def cost(self, candidate: Candidate) -> Tensor:
        return self.value(candidate, "stability")


class Ground(Physics):
    def cost(self, candidate: Candidate) -> Tensor:
        return self.value(candidate, "pull", "push")


class Balance(Physics):
    def __init__(self, problem: Problem, preset: str = "balanced", samples: int | None = None, only_static: bool = False):
        super().__init__(problem, preset, samples, only_static)
        if "balance" not in self.loss.terms:
            raise ValueError(f"balance: preset {preset!r} has stability in its place; expected 'balanced'")

    def cost(self, candidate: Candidate) -> Tensor:
        return self.value(candidate, "balance")


@lru_cache(maxsize=16)
def _loss(template: ipt.BodyTemplate, preset: str, samples: int | None) -> ipt.IntuitivePhysicsLoss:
    """One object for all terms of the same constants: by it they find each other's evaluation."""
    if samples is not None and samples != template.num_samples:
        template = _resampled(template, samples)
    return ipt.IntuitivePhysicsLoss(template, preset=preset, reduction="none")


@lru_cache(maxsize=16)
def _resampled(template: ipt.BodyTemplate, samples: int) -> ipt.BodyTemplate:
    return ipt.BodyTemplate(
        template.vertices, template.faces, template.face_parts, template.part_names, num_samples=samples
    )
