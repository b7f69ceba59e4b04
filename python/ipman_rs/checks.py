"""One way to refuse unknown words and meaningless numbers, for the numpy and the torch layer.

Raises:
    ValueError: a word or a number out of range; the message names the argument and what was expected.
    TypeError: no number at all.
"""

from __future__ import annotations

import math
from typing import Any, get_args

import numpy as np


def number(name: str, value: float) -> float:
    """A finite real number, as a float."""
    if isinstance(value, (bool, np.bool_)) or not isinstance(value, (int, float, np.integer, np.floating)):
        raise TypeError(f"{name}: expected a number, got {value!r}")
    if not -math.inf < value < math.inf:  # math.isfinite would stop torch.compile
        raise ValueError(f"{name}: expected a finite number, got {value!r}")
    return float(value)


def positive(name: str, value: float, unit: str = "metres") -> float:
    """A finite number above zero."""
    if not number(name, value) > 0.0:
        raise ValueError(f"{name}: expected positive {unit}, got {value!r}")
    return float(value)


def not_negative(name: str, value: float) -> float:
    """A finite number, zero or above."""
    if not number(name, value) >= 0.0:
        raise ValueError(f"{name}: expected zero or more, got {value!r}")
    return float(value)


def whole(name: str, value: int, low: int, high: int) -> int:
    """A whole number from `low` to `high`."""
    if isinstance(value, bool) or not isinstance(value, (int, np.integer)):
        raise TypeError(f"{name}: expected a whole number, got {value!r}")
    if not low <= value <= high:
        raise ValueError(f"{name}: expected {low} to {high}, got {value}")
    return int(value)


def choice(name: str, value: str, words: Any) -> str:
    """`value`, if it is one of the words of a `Literal`."""
    options = get_args(words)
    if value not in options:
        raise ValueError(f"{name}: expected one of {', '.join(options)}, got {value!r}")
    return value
