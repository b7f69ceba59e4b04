"""Shape prior: Σ β², the coefficients being standard deviations of the population that the model was made from."""

from __future__ import annotations

from torch import Tensor

from ..candidate import Candidate
from .term import LeastSquares


class ShapePrior(LeastSquares):
    def residuals(self, candidate: Candidate) -> Tensor:
        return candidate.variables["betas"]
