"""Solvers, written for one body: generators that yield a point and are sent what the objective is there.

`drive.minimise` runs one a body and evaluates the points of all bodies together, so a body's way through the solver
knows nothing of its batch.
"""

from __future__ import annotations

from .drive import minimise
from .lbfgs import lbfgs
from .levenberg import levenberg
from .outcome import Evaluation, Options, Outcome

SOLVERS = {"lbfgs": lbfgs, "levenberg": levenberg}

__all__ = ["SOLVERS", "Evaluation", "Options", "Outcome", "minimise"]
