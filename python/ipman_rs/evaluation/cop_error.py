"""Error of the centre of pressure."""

from __future__ import annotations

from typing import Any

from numpy.typing import ArrayLike

from .numpy_or_torch import AnyGround, numpy_or_torch
from .points import norm, vectors


@numpy_or_torch
def cop_error(estimated: ArrayLike, true: ArrayLike, ground: AnyGround) -> Any:
    """Distance along the ground between two centres of pressure, (..., 3) -> (...) m; NaN where one is not finite.

    Heights do not count, because a mat measures none.

    Raises:
        ValueError: the shapes differ.
    """
    first, second = vectors("centres of pressure", estimated, true)
    difference = first - second
    return norm(difference - (difference * ground.normal).sum(axis=-1, keepdims=True) * ground.normal)
