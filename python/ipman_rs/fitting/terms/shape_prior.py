"""Shape prior: Σ β², the coefficients being standard deviations of the population that the model was made from."""

from __future__ import annotations

from collections.abc import Sequence

import torch
from torch import Tensor

from ..candidate import Candidate
from ..variables import diagonal
from .term import LeastSquares


class ShapePrior(LeastSquares):
    def residuals(self, candidate: Candidate) -> Tensor:
        return candidate.variables["betas"]

    def linearised(self, candidate: Candidate, free: Sequence[str]) -> tuple[Tensor, Tensor]:
        betas = candidate.variables["betas"]
        return betas, diagonal(torch.ones_like(betas), "betas", candidate.variables, free)
