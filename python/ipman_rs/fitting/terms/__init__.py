"""The terms of fitting objectives, one a file. A new one is one file and one line here."""

from __future__ import annotations

from .reprojection import Reprojection
from .self_contact import SelfContact, SelfPenetration
from .term import LeastSquares, Term

TERMS: dict[str, type[Term]] = {
    "reprojection": Reprojection,
    "self_contact": SelfContact,
    "self_penetration": SelfPenetration,
}

__all__ = ["TERMS", "LeastSquares", "Term"]
