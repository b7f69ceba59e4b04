"""vmap for operations that already take a batch: the mapped axis is folded into the leading one and unfolded again."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from torch import Tensor


def fold(batch_size: int, in_dims: Sequence[int | None], args: Sequence[Any]) -> list[Any]:
    """Arguments as one batch: tensors (…, B, rest) mapped at in_dims become (batch_size · B, rest).

    A tensor that is not mapped is repeated (as a view where possible); everything else passes through.
    """
    folded = []
    for dim, arg in zip(in_dims, args, strict=True):
        if isinstance(arg, Tensor):
            mapped = arg.expand(batch_size, *arg.shape) if dim is None else arg.movedim(dim, 0)
            arg = mapped.flatten(0, 1)
        folded.append(arg)
    return folded


def unfold(batch_size: int, output: Tensor) -> Tensor:
    """(batch_size · B, rest) -> (batch_size, B, rest)."""
    return output.unflatten(0, (batch_size, output.shape[0] // batch_size if batch_size else 0))
