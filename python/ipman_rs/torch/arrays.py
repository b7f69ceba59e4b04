"""Tensors as what the compiled core and the numpy layer take."""

from __future__ import annotations

from typing import Any

import torch
from torch import Tensor

from .threads import follow_torch

_REAL = (torch.float16, torch.bfloat16, torch.float32, torch.float64)
_WHOLE = (torch.uint8, torch.int8, torch.int16, torch.int32, torch.int64)


def dense(name: str, value: Any, whole: bool = False, meta: bool = False) -> Tensor:
    """`value`, if it is an ordinary tensor of real numbers, or, with `whole`, of whole ones; with `meta` also one
    without contents.

    Raises:
        TypeError: no tensor, another dtype, or one that is sparse, nested, quantised or without contents (meta).
    """
    if not isinstance(value, Tensor):
        raise TypeError(
            f"{name}: expected a floating-point tensor, got {type(value).__name__}; numpy arrays go to ipman_rs itself"
        )
    special = "nested" if value.is_nested else "quantised" if value.is_quantized else None
    if special is None and value.layout != torch.strided:
        special = str(value.layout).removeprefix("torch.")
    if special is None and value.device.type == "meta" and not meta:
        special = "meta"
    if special is not None:
        raise TypeError(f"{name}: expected an ordinary tensor, got a {special} one; make it dense first")
    if value.dtype not in _REAL and not (whole and value.dtype in _WHOLE):
        raise TypeError(f"{name}: expected a floating-point tensor (float16 to float64), got {value.dtype}")
    return value


def memory(tensor: Tensor | None) -> Any:
    """The tensor's numbers in C order: its own memory, or a copy where that is elsewhere or ordered otherwise."""
    return None if tensor is None else tensor.contiguous().numpy(force=True)


def single_or_double(tensor: Tensor) -> Tensor:
    """Half precision in float32, all else as it is; the gradient goes back in the type that was given."""
    computed = torch.promote_types(tensor.dtype, torch.float32)
    return tensor if tensor.dtype == computed else tensor.to(computed)


def as_array(vertices: Tensor) -> Any:
    """Vertices for a function of `ipman_rs`, which is going to compute on as many threads as torch."""
    dense("vertices", vertices)
    follow_torch()
    return memory(single_or_double(vertices))
