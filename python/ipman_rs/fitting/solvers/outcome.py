"""The interface of solvers: their options, the evaluations they receive, and their outcome."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

Vector = NDArray[np.float64]

CONVERGED = ("gradient", "decrease")  # reasons of an outcome


@dataclass(frozen=True)
class SolverOptions:
    """When to stop. Tolerances are absolute: a saturated ground term is a constant that would fool relative ones."""

    iterations: int = 100
    gradient: float = 1e-4  # of the largest component
    decrease: float = 1e-6  # of the cost, in each of the last three iterations


@dataclass(frozen=True)
class ValueAndGradient:
    """The objective at a point: value, gradient (P,), and a model of the Hessian for solvers that need it: (P, P), or a
    structured one that has its own `solve`."""

    value: float
    gradient: Vector
    hessian: Any = None

    @property
    def finite(self) -> bool:
        return bool(np.isfinite(self.value) and np.isfinite(self.gradient).all())


@dataclass(frozen=True)
class Outcome:
    """The best point (P,) and how it was reached. reason: "gradient", "decrease" (both converged), "iterations", "no
    descent" or "not finite" (the start itself, which is handed back)."""

    point: Vector
    value: float
    iterations: int
    reason: str

    @property
    def converged(self) -> bool:
        return self.reason in CONVERGED
