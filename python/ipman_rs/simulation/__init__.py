"""Rigid bodies: how firmly they stand (`tip_test`), and whether they fall when they are dropped (`simulate`).

`compare` says which of two methods has the more stable bodies.
"""

from __future__ import annotations

from ..renamed import old_names
from .comparison import Means, MethodComparison, compare
from .fall import ENGINES, VERDICT, Simulation, simulate
from .tipping import FALLEN, TipTest, tip_test

__all__ = [
    "ENGINES",
    "FALLEN",
    "VERDICT",
    "MethodComparison",
    "Means",
    "Simulation",
    "TipTest",
    "compare",
    "simulate",
    "tip_test",
]

__getattr__ = old_names(__name__, {"Comparison": "MethodComparison"})
