"""Metrics for numpy and torch: each is written once, for arrays, and returns tensors if it is given tensors.

Metrics are not losses: tensors are copied to the CPU and computed there in float64, with the same bits as arrays; the
results are returned on the tensor's device, without a gradient.
"""

from __future__ import annotations

import functools
import sys
from collections.abc import Callable
from typing import Any, ParamSpec, TypeAlias, TypeVar

import numpy as np

AnyGround: TypeAlias = Any  # ipman_rs.Ground or ipman_rs.torch.Ground

Parameters = ParamSpec("Parameters")
Result = TypeVar("Result")


def numpy_or_torch(metric: Callable[Parameters, Result]) -> Callable[Parameters, Result]:
    """Decorator: a metric of arrays that also takes tensors, and grounds of `ipman_rs` or of `ipman_rs.torch`."""

    @functools.wraps(metric)
    def either(*args: Parameters.args, **options: Parameters.kwargs) -> Result:
        arguments: list[Any] = [*args, *options.values()]
        if any(map(_is_torch, arguments)):
            named = {name: as_array(value) for name, value in options.items()}
            result = metric(*[as_array(value) for value in args], **named)  # type: ignore[arg-type]
        else:
            result = metric(*args, **options)
        devices = [value.device for value in arguments if _is_tensor(value)]
        return _to_device(result, devices[0] if devices else None)

    return either


def as_array(value: Any) -> Any:
    """A tensor as an array, a ground of tensors as one of arrays; anything else unchanged."""
    if not _is_torch(value):
        return value
    import torch

    from ipman_rs.torch.ground import Ground as TorchGround
    from ipman_rs.torch.ground import as_numpy_ground
    from ipman_rs.torch.threads import follow_torch

    follow_torch()  # the core is going to compute on as many threads
    if isinstance(value, TorchGround):
        return as_numpy_ground(value)
    return (value.float() if value.dtype == torch.bfloat16 else value).numpy(force=True)


def _is_tensor(value: Any) -> bool:
    torch = sys.modules.get("torch")  # never imported for arrays
    return torch is not None and isinstance(value, torch.Tensor)


def _is_torch(value: Any) -> bool:
    """A tensor, or a ground of tensors."""
    return _is_tensor(value) or type(value).__module__ == "ipman_rs.torch.ground"


def _to_device(result: Any, device: Any) -> Any:
    """Arrays as tensors on the device, or unchanged if it is None; arrays without a dimension become numbers."""
    if isinstance(result, tuple):
        parts = [_to_device(part, device) for part in result]
        return type(result)(*parts) if hasattr(result, "_fields") else tuple(parts)
    if device is None:
        return result[()]
    import torch

    return torch.from_numpy(np.array(result)).to(device)
