"""One way to refuse unknown words, meaningless numbers and odd arrays, for the numpy and the torch layer.

Raises:
    ValueError: a word or a number out of range; the message names the argument and what was expected.
    TypeError: no number at all.
"""

from __future__ import annotations

import sys
from typing import Any, get_args

import numpy as np
from numpy.typing import ArrayLike, NDArray

LARGEST = 1e12  # of any option: single precision can still multiply it
SMALLEST = 1e-12  # of options that divide


def number(name: str, value: float) -> float:
    """A real number of a size that can be computed with, as a float."""
    if isinstance(value, (bool, np.bool_, np.timedelta64)) or not isinstance(
        value, (int, float, np.integer, np.floating)
    ):
        raise TypeError(f"{name}: expected a number, got {_shown(value)}")
    if isinstance(value, np.floating):
        value = value.item()  # half precision has no LARGEST
    if not -LARGEST <= value <= LARGEST:  # math.isfinite would stop torch.compile
        raise ValueError(f"{name}: expected a finite number of at most {LARGEST:g}, got {_shown(value)}")
    return float(value)


def body_template(value: Any) -> Any:
    """`value`, if it is a template."""
    if not hasattr(value, "_core"):
        raise TypeError(f"template: expected ipman_rs.BodyTemplate, got {type(value).__name__}")
    return value


def positive(name: str, value: float, unit: str = "metres") -> float:
    """A number above zero, and not so small that nothing can be divided by it."""
    if not number(name, value) >= SMALLEST:
        raise ValueError(f"{name}: expected positive {unit}, got {_shown(value)}")
    return float(value)


def not_negative(name: str, value: float) -> float:
    """A number, zero or above."""
    if not number(name, value) >= 0.0:
        raise ValueError(f"{name}: expected zero or more, got {_shown(value)}")
    return float(value)


def whole(name: str, value: int, low: int, high: int) -> int:
    """A whole number from `low` to `high`."""
    if isinstance(value, (bool, np.timedelta64)) or not isinstance(value, (int, np.integer)):
        raise TypeError(f"{name}: expected a whole number, got {_shown(value)}")
    if not low <= value <= high:
        raise ValueError(f"{name}: expected {low} to {high}, got {_shown(value)}")
    return int(value)


def choice(name: str, value: str, words: Any) -> str:
    """`value`, if it is one of the words of a `Literal`."""
    options = get_args(words)
    if not isinstance(value, str) or value not in options:
        raise ValueError(f"{name}: expected one of {', '.join(options)}, got {_shown(value)}")
    return value


def _shown(value: Any) -> str:
    """A value for a message, not endless; Python refuses to write out whole numbers of many digits."""
    try:
        text = repr(value)
    except ValueError:
        return f"a {type(value).__name__} of many digits"
    return text if len(text) <= 80 else f"{text[:77]}..."


def real_array(name: str, value: ArrayLike) -> NDArray[Any]:
    """An ordinary array of real numbers; masked arrays are refused, for their mask would be lost."""
    masked = sys.modules.get("numpy.ma")  # not imported here: that would cost every user 30 ms
    if masked is not None and _holds(value, masked.MaskedArray):
        raise TypeError(f"{name}: masked arrays are not supported, for the mask would be ignored; fill or drop first")
    try:
        array = np.asarray(value)
    except ValueError as error:
        raise ValueError(f"{name}: expected a regular array of numbers ({error})") from None
    if array.dtype.kind not in "fiu":
        raise TypeError(f"{name}: expected real numbers, got dtype {array.dtype}")
    return array


def _holds(value: Any, kind: type) -> bool:
    """Whether a value is of that kind, or a list that starts with one."""
    while isinstance(value, (list, tuple)) and value:
        value = value[0]
    return isinstance(value, kind)


def single_or_double(array: NDArray[Any]) -> NDArray[Any]:
    """float32 and half stay or become native float32; everything else becomes native float64."""
    dtype = np.float32 if array.dtype.kind == "f" and array.dtype.itemsize <= 4 else np.float64
    with np.errstate(over="ignore", invalid="ignore"):  # what double precision cannot hold becomes infinite
        return np.require(array, dtype, ["C", "A"])  # what comes from packed records is not aligned
