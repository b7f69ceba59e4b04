"""What a term of a fitting objective is.

A term is made once a fit, by `SomeTerm(problem, **options)`, and looked at once an evaluation. Rows must not know of
each other: nothing may be summed, sorted or multiplied across bodies, so that a body's result does not depend on its
batch.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Sequence
from typing import Any

import torch
from torch import Tensor
from torch.autograd import forward_ad

from ..candidate import Candidate
from ..problem import Problem
from ..variables import pack, unpack


class Term(ABC):
    """One number a body, to be made small."""

    needs_mesh = False  # whether it looks at `candidate.vertices` or `.posed`

    def __init__(self, problem: Problem, **options: Any):
        self.problem = problem
        self.options = options

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

    def linearised(self, candidate: Candidate, free: Sequence[str]) -> tuple[Tensor, Tensor]:
        """The residuals (B, R) and their Jacobian (B, P, R) by the free blocks: by forward mode, every body once a
        direction. A term that every fit has does better with its own derivatives."""
        rows = pack(candidate.variables, free)
        bodies, size = rows.shape
        copies = torch.arange(bodies).repeat_interleave(size)
        repeated = type(self)(self.problem.rows(copies), **self.options)
        variables = {name: value[copies] for name, value in candidate.variables.items()}
        directions = torch.eye(size, dtype=rows.dtype).repeat(bodies, 1)
        with forward_ad.dual_level(), torch.no_grad():
            dual = forward_ad.make_dual(rows[copies], directions)
            moved = Candidate(repeated.problem, unpack(dual, free, variables))
            value, slope = forward_ad.unpack_dual(repeated.residuals(moved))
            slope = torch.zeros_like(value) if slope is None else slope
        return value[::size], slope.reshape(bodies, size, -1)
