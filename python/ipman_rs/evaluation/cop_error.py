"""Error of the centre of pressure."""

from __future__ import annotations

from typing import Any

from numpy.typing import ArrayLike

from .numpy_or_torch import AnyGround, numpy_or_torch
from .points import norm, vectors


@numpy_or_torch
def cop_error(estimated: ArrayLike, true: ArrayLike, ground: AnyGround) -> Any:
    """Distance along the ground of two centres of pressure, (..., 3) -> (...) m; NaN where one is not finite.

    Heights do not count: a mat measures none. ValueError where the shapes differ.
    """
    first, second = vectors("centres of pressure", estimated, true)
    apart = first - second
    return norm(apart - (apart * ground.normal).sum(axis=-1, keepdims=True) * ground.normal)
