"""Derivatives in forward mode, as `torch.autograd.forward_ad` has them."""

from __future__ import annotations

import warnings
from functools import cache

import torch
from torch import Tensor
from torch.autograd import forward_ad


def dual(values: Tensor, directions: Tensor) -> Tensor:
    """Values with a direction each, inside `forward_ad.dual_level`."""
    _load()
    return forward_ad.make_dual(values, directions)


@cache
def _load() -> None:
    """torch's first `make_dual` imports a module of its own that calls `torch.jit.script`, which torch deprecates."""
    with warnings.catch_warnings():
        warnings.filterwarnings("ignore", message="`torch.jit.script`", category=FutureWarning)
        forward_ad.make_dual(torch.zeros(1), torch.zeros(1))
