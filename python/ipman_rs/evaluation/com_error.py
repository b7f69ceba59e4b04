"""Error of the centre of mass."""

from __future__ import annotations

from typing import Any

from numpy.typing import ArrayLike

from .numpy_or_torch import numpy_or_torch
from .points import norm, vectors


@numpy_or_torch
def com_error(estimated: ArrayLike, true: ArrayLike) -> Any:
    """Distance in space between two centres of mass, (..., 3) -> (...) m; NaN where one is not finite.

    Raises:
        ValueError: the shapes differ.
    """
    first, second = vectors("centres of mass", estimated, true)
    return norm(first - second)
