"""MPJPE: mean per-joint position error, aligned at the pelvis, or after the best similarity (PA-MPJPE)."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from numpy.typing import ArrayLike

from .numpy_or_torch import numpy_or_torch
from .points import Array, norm, pair
from .procrustes import align


@numpy_or_torch
def mpjpe(estimated: ArrayLike, true: ArrayLike, root: int | Sequence[int] | None = 0) -> Any:
    """Mean distance of corresponding joints, (..., J, 3) -> (...) m.

    Args:
        root: the joint at which both are aligned first, or several joints, at whose mean they are (both hips where a
            skeleton has no pelvis); None: no alignment.

    Raises:
        ValueError: the shapes differ.
    """
    first, second = pair("joints", estimated, true)
    if root is not None:
        first, second = first - _pelvis(first, root), second - _pelvis(second, root)
    return norm(first - second).mean(axis=-1)


@numpy_or_torch
def pa_mpjpe(estimated: ArrayLike, true: ArrayLike) -> Any:
    """MPJPE, (..., J, 3) -> (...) m, after the similarity (rotation, scale, translation) that brings the estimated
    joints closest to the true ones.

    Raises:
        ValueError: the shapes differ.
    """
    first, second = pair("joints", estimated, true)
    return norm(align(first, second) - second).mean(axis=-1)


def _pelvis(joints: Array, root: int | Sequence[int]) -> Array:
    return joints[..., [root] if isinstance(root, int) else list(root), :].mean(axis=-2, keepdims=True)
