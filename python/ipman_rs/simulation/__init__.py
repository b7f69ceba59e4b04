"""Stiff bodies: how firmly they stand (`tip_test`), and what becomes of them when they are let go (`simulate`)."""

from __future__ import annotations

from .fall import ENGINES, Simulation, simulate
from .tipping import FALLEN, TipTest, tip_test

__all__ = ["ENGINES", "FALLEN", "Simulation", "TipTest", "simulate", "tip_test"]
