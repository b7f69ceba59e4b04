"""Why a frame has no figure."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .numpy_or_torch import as_array


def reasons(conditions: Mapping[str, ArrayLike]) -> NDArray[np.str_]:
    """For each frame the first of the conditions that holds, (F,), "" where none does: {what: (F,) bool}, such as
    {"no ground truth": …, "prediction not finite": …}. For `Accumulator.add(why=...)`."""
    flags = [np.asarray(as_array(flag), bool) for flag in conditions.values()]
    return np.select(flags, list(conditions), default="")
