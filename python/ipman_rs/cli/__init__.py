"""The command line: `ipman demo`, `ipman analyze` and `ipman fit`. Heavy imports wait until a command runs."""

from __future__ import annotations

from .commands import main

__all__ = ["main"]
