"""The objective of a stage: its weighted terms, their gradients, and a Gauss-Newton model of their Hessian."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import torch
from torch import Tensor
from torch.autograd import forward_ad

from .candidate import Candidate
from .forward_mode import dual
from .problem import Problem
from .solvers import ValueAndGradient
from .terms import TERMS, LeastSquares, Term
from .variables import Variables, unpack

Weights = Mapping[str, float]


class Objective:
    """Σ weight · term over the `free` blocks of the variables; the other blocks stay as they are in `variables`.

    With the terms and weights of the preset `ipman-o` it is the paper's E_IPMAN-O (Eq. 9).

    Bodies are evaluated together and know nothing of each other. Raises ValueError for an unknown term.
    """

    def __init__(
        self,
        problem: Problem,
        variables: Variables,
        free: Sequence[str],
        weights: Weights,
        options: Mapping[str, Mapping[str, Any]] | None = None,
    ):
        unknown = sorted(set(weights) - set(TERMS))
        if unknown:
            raise ValueError(f"weights: expected terms out of {', '.join(sorted(TERMS))}, got {', '.join(unknown)}")
        self.problem, self.variables, self.free = problem, variables, tuple(free)
        self.weights = {name: weight for name, weight in weights.items() if weight}
        self.options = options or {}
        self.terms: dict[str, Term] = {
            name: TERMS[name](problem, **self.options.get(name, {})) for name in self.weights
        }
        self._repeated: Objective | None = None

    def rows(self, index: Sequence[int]) -> Objective:
        """The same objective of some bodies."""
        picked = torch.as_tensor(index)
        variables = {name: value[picked] for name, value in self.variables.items()}
        return Objective(self.problem.rows(picked), variables, self.free, self.weights, self.options)

    def candidate(self, rows: Tensor) -> Candidate:
        """The bodies whose free blocks are `rows` (B, P)."""
        return Candidate(self.problem, unpack(rows, self.free, self.variables))

    def costs(self, candidate: Candidate) -> dict[str, Tensor]:
        """The weighted cost (B,) of each term."""
        return {name: self._cost(name, candidate) for name in self.weights}

    def evaluations(self, points: np.ndarray) -> list[ValueAndGradient]:
        """Value and gradient at the points (B, P)."""
        rows = torch.from_numpy(points).requires_grad_()
        total = sum(self.costs(self.candidate(rows)).values(), torch.zeros(len(points), dtype=torch.float64))
        return [ValueAndGradient(float(v), g) for v, g in zip(*_with_gradient(total, rows), strict=True)]

    def models(self, points: np.ndarray) -> list[ValueAndGradient]:
        """With a model of the Hessian: 2 JᵀJ of the least squares, and for every other term, a cost c ≥ 0 seen as the
        square of √c, the gradient's ggᵀ / 2c."""
        squares = [name for name, term in self.terms.items() if isinstance(term, LeastSquares) and not term.needs_mesh]
        residuals, jacobians = self._jacobian(points, squares)
        rows = torch.from_numpy(points).requires_grad_()
        candidate = self.candidate(rows)  # one for all terms: its mesh is posed once
        others = [_with_gradient(self._cost(name, candidate), rows) for name in self.weights if name not in squares]
        evaluations = []
        for body in range(len(points)):
            r, j = residuals[body], jacobians[body]
            value, gradient, hessian = float(r @ r), (2 * j @ r).numpy(), (2 * j @ j.T).numpy()
            for values, gradients in others:
                cost, slope = float(values[body]), gradients[body]
                value, gradient = value + cost, gradient + slope
                if cost > 0:
                    hessian = hessian + np.outer(slope, slope) / (2 * cost)
            evaluations.append(ValueAndGradient(value, gradient, hessian))
        return evaluations

    def _cost(self, name: str, candidate: Candidate) -> Tensor:
        """The weighted cost (B,) of one term."""
        return self.weights[name] * self.terms[name].cost(candidate).double()

    def _jacobian(self, points: np.ndarray, names: Sequence[str]) -> tuple[Tensor, Tensor]:
        """Weighted residuals (B, R) and their Jacobians (B, P, R)."""
        bodies, size = points.shape
        values, slopes = (
            [torch.zeros(bodies, 0, dtype=torch.float64)],
            [torch.zeros(bodies, size, 0, dtype=torch.float64)],
        )
        with torch.no_grad():
            candidate = self.candidate(torch.from_numpy(points))
            unknown = []
            for name in names:
                term = self.terms[name]
                closed = term.linearised(candidate, self.free) if isinstance(term, LeastSquares) else None
                if closed is None:
                    unknown.append(name)
                else:
                    values.append(self.weights[name] ** 0.5 * closed[0])
                    slopes.append(self.weights[name] ** 0.5 * closed[1])
            if unknown:
                value, slope = self._by_forward_mode(points, unknown)
                values.append(value)
                slopes.append(slope)
        return torch.cat(values, dim=1), torch.cat(slopes, dim=2)

    def _by_forward_mode(self, points: np.ndarray, names: Sequence[str]) -> tuple[Tensor, Tensor]:
        """The same of some terms, with every body once a direction."""
        bodies, size = points.shape
        if self._repeated is None:
            self._repeated = self.rows(np.repeat(np.arange(bodies), size).tolist())
        rows = torch.from_numpy(points).repeat_interleave(size, dim=0)
        directions = torch.eye(size, dtype=torch.float64).repeat(bodies, 1)
        with forward_ad.dual_level():
            candidate = self._repeated.candidate(dual(rows, directions))
            residuals = []
            for name in names:
                term = self._repeated.terms[name]
                assert isinstance(term, LeastSquares)
                residuals.append(self.weights[name] ** 0.5 * term.residuals(candidate))
            value, slope = forward_ad.unpack_dual(torch.cat(residuals, dim=1))
        slope = torch.zeros_like(value) if slope is None else slope
        return value[::size], slope.reshape(bodies, size, -1)


def _with_gradient(costs: Tensor, rows: Tensor) -> tuple[np.ndarray, np.ndarray]:
    """Costs (B,) and their gradients by the rows (B, P); the graph stays for the other terms of its candidate."""
    if not costs.requires_grad:
        return costs.numpy(), np.zeros(rows.shape)
    (gradient,) = torch.autograd.grad(costs.sum(), rows, retain_graph=True)
    return costs.detach().numpy(), gradient.numpy()
