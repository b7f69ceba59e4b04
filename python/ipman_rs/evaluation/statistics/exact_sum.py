"""Exact sums, which do not depend on the order or the grouping of the summands.

A number is split into four integers, its digits in base 2³² with weights from 2³² down to 2⁻⁶⁴, and each digit is
summed separately in int64. Numbers under 2³¹ keep all bits above 2⁻⁶⁵ (for 0.001 that is every bit of a float64); up to
2³¹ numbers can be summed.
"""

from __future__ import annotations

from fractions import Fraction

import numpy as np
from numpy.typing import NDArray

LIMBS = 4
LARGEST = 2.0**31  # so that squares fit, too

Limbs = NDArray[np.int64]


def limbs(values: NDArray[np.float64]) -> Limbs:
    """(n,) finite numbers under 2⁶² as digits (n, 4)."""
    digits = np.empty((len(values), LIMBS), np.int64)
    rest = values * 2.0**-32
    for place in range(LIMBS):
        digit = np.trunc(rest) if place < LIMBS - 1 else np.rint(rest)
        digits[:, place] = digit
        rest = (rest - digit) * 2.0**32  # both exact
    return digits


def exact(total: Limbs) -> Fraction:
    """The number that summed digits (4,) stand for."""
    units = 0
    for digit in total.tolist():
        units = (units << 32) + digit
    return Fraction(units, 1 << 64)
