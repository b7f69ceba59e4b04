"""What a term of a fitting objective is.

A term is made once a fit, by `SomeTerm(problem, **options)`, and looked at once an evaluation. Rows must not know of each
other: nothing may be summed, sorted or multiplied across bodies, so that a body's result does not depend on its batch.
"""

from __future__ import annotations

from abc import ABC, abstractmethod

from torch import Tensor

from ..candidate import Candidate
from ..problem import Problem


class Term(ABC):
    """One number a body, to be made small."""

    needs_mesh = False  # whether it looks at `candidate.vertices` or `.posed`

    def __init__(self, problem: Problem):
        self.problem = problem

    def begin(self, candidate: Candidate) -> None:  # noqa: B027  most terms have nothing to note
        """Called with the bodies that a stage starts from, before its first evaluation."""

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
