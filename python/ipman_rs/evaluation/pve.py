"""PVE: per-vertex error."""

from __future__ import annotations

from typing import Any

from numpy.typing import ArrayLike

from .numpy_or_torch import numpy_or_torch
from .points import norm, pair, vector


@numpy_or_torch
def pve(
    estimated: ArrayLike, true: ArrayLike, root: ArrayLike | None = None, true_root: ArrayLike | None = None
) -> Any:
    """Mean distance of corresponding vertices, (..., V, 3) -> (...) m: in the world, or aligned at the roots.

    Args:
        root, true_root: (..., 3), such as the pelvis of each, at which both bodies are aligned first. Both or none.

    Raises:
        ValueError: the shapes differ, or one root is missing.
    """
    first, second = pair("vertices", estimated, true)
    if (root is None) != (true_root is None):
        raise ValueError("root, true_root: expected both or none, got one")
    if root is not None and true_root is not None:
        first = first - vector("root", root)[..., None, :]
        second = second - vector("true_root", true_root)[..., None, :]
    return norm(first - second).mean(axis=-1)
