"""Expression prior (SMPLify-X): Σ ψ², the coefficients being standard deviations; 0 for bodies without expressions."""

from __future__ import annotations

from collections.abc import Sequence

import torch
from torch import Tensor

from ..candidate import Candidate
from ..variables import diagonal
from .term import LeastSquares


class ExpressionPrior(LeastSquares):
    def residuals(self, candidate: Candidate) -> Tensor:
        return candidate.variables["expression"]

    def linearised(self, candidate: Candidate, free: Sequence[str]) -> tuple[Tensor, Tensor]:
        expression = candidate.variables["expression"]
        return expression, diagonal(torch.ones_like(expression), "expression", candidate.variables, free)
