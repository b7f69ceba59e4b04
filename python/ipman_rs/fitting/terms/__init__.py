"""The terms of fitting objectives, one a file. A new one is one file and one line here."""

from __future__ import annotations

from .reprojection import Reprojection
from .term import LeastSquares, Term

TERMS: dict[str, type[Term]] = {
    "reprojection": Reprojection,
}

__all__ = ["TERMS", "LeastSquares", "Term"]
