"""Solvers, written for one body: generators that yield a point and are sent the objective's `Evaluation` there.

`drive.minimise` runs one solver per body and evaluates the points of all bodies together, so a body's iterates do not
depend on its batch.
"""

from __future__ import annotations

from .drive import minimise
from .lbfgs import lbfgs
from .levenberg import levenberg
from .outcome import Evaluation, Options, Outcome

SOLVERS = {"lbfgs": lbfgs, "levenberg": levenberg}

__all__ = ["SOLVERS", "Evaluation", "Options", "Outcome", "minimise"]
