"""Solvers, written for one body: generators that yield a point and are sent the objective's `ValueAndGradient` there.

`drive.minimise` runs one solver per body and evaluates the points of all bodies together, so a body's iterates do not
depend on its batch.
"""

from __future__ import annotations

from ipman_rs.renamed import old_names

from .drive import minimise
from .lbfgs import lbfgs
from .levenberg import levenberg
from .outcome import Outcome, SolverOptions, ValueAndGradient

__getattr__ = old_names(__name__, {"Options": "SolverOptions"})

SOLVERS = {"lbfgs": lbfgs, "levenberg": levenberg}

__all__ = ["SOLVERS", "ValueAndGradient", "SolverOptions", "Outcome", "minimise"]
