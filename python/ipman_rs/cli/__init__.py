"""The command line: `ipman demo`, `analyze`, `fit` and `simulate`. Heavy imports wait until a command runs."""

from __future__ import annotations

from .commands import main

__all__ = ["main"]
