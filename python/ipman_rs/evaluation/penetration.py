"""Penetration of a body into the ground, and its hover above it."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from .numpy_or_torch import AnyGround, numpy_or_torch
from .points import points


@numpy_or_torch
def penetration(vertices: ArrayLike, ground: AnyGround) -> Any:
    """Depth of the deepest vertex below the ground, 0 for a body above it: (..., V, 3) -> (...) m. NaN for a body that
    is not finite."""
    return (-lowest(vertices, ground)).clip(min=0)


@numpy_or_torch
def hover(vertices: ArrayLike, ground: AnyGround) -> Any:
    """Height of the lowest vertex above the ground, 0 for a body that reaches it: (..., V, 3) -> (...) m. NaN for a
    body that is not finite."""
    return lowest(vertices, ground).clip(min=0)


@numpy_or_torch
def lowest(vertices: ArrayLike, ground: AnyGround) -> Any:
    """Signed height of the lowest vertex above the ground, (..., V, 3) -> (...) m. NaN if the body is not finite."""
    heights = ground.signed_height(points("vertices", vertices))
    return np.where(np.isfinite(heights.max(axis=-1)), heights.min(axis=-1), np.nan)
