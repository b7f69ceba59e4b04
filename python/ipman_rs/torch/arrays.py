"""Tensors as what the compiled core and the numpy layer take."""

from __future__ import annotations

from typing import Any

import torch
from torch import Tensor

from .threads import follow_torch


def memory(tensor: Tensor | None) -> Any:
    """The tensor's numbers in C order: its own memory, or a copy where that is elsewhere or ordered otherwise."""
    return None if tensor is None else tensor.contiguous().numpy(force=True)


def single_or_double(tensor: Tensor) -> Tensor:
    """Half precision in float32, all else as it is; the gradient goes back in the type that was given."""
    computed = torch.promote_types(tensor.dtype, torch.float32)
    return tensor if tensor.dtype == computed else tensor.to(computed)


def as_array(vertices: Tensor) -> Any:
    """Vertices for a function of `ipman_rs`, which is going to compute on as many threads as torch."""
    follow_torch()
    return memory(single_or_double(vertices))
