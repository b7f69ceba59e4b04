"""The interface of the terms of a fitting objective.

A term is constructed once per fit, by `SomeTerm(problem, **options)`, and computed once per evaluation. Bodies must not
influence each other: nothing may be summed, sorted or multiplied across rows, so that a body's result does not depend
on its batch.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Sequence

from torch import Tensor

from ..candidate import Candidate
from ..problem import Problem


class Term(ABC):
    """One cost per body, to be minimised."""

    needs_mesh = False  # whether it looks at `candidate.vertices` or `.posed`

    def __init__(self, problem: Problem):
        self.problem = problem

    @abstractmethod
    def cost(self, candidate: Candidate) -> Tensor:
        """(B,), ≥ 0."""


class LeastSquares(Term):
    """A term that is a sum of squares: solvers that know its residuals need few steps."""

    @abstractmethod
    def residuals(self, candidate: Candidate) -> Tensor:
        """(B, R)."""

    def cost(self, candidate: Candidate) -> Tensor:
        return self.residuals(candidate).square().sum(dim=-1)

    def linearised(self, candidate: Candidate, free: Sequence[str]) -> tuple[Tensor, Tensor] | None:
        """The residuals (B, R) and their Jacobian (B, P, R) by the free blocks, for terms that know it in closed form;
        of the others the objective finds it by forward mode, every body once a direction."""
        return None
