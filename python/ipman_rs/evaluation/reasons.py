"""Reasons for missing values: why a frame has no metric."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .numpy_or_torch import as_array


def reasons(conditions: Mapping[str, ArrayLike]) -> NDArray[np.str_]:
    """The first condition that holds for each frame, (F,) text, "" where none does.

    conditions: {reason: (F,) bool}, such as {"no ground truth": …, "prediction not finite": …}. The result is what
    `Accumulator.add(why=...)` takes.
    """
    flags = [np.asarray(as_array(flag), bool) for flag in conditions.values()]
    return np.select(flags, list(conditions), default="")
