"""numpy and torch alike: a metric is written once, on arrays, and given tensors it returns tensors.

Metrics are no losses: the numbers of a tensor are copied to the CPU, computed there in float64 as those of an array
are, so to the same bits, and the results go back to the tensor's device without a gradient.
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
    """The metric for arrays and for tensors; a ground may be that of `ipman_rs` or of `ipman_rs.torch`."""

    @functools.wraps(metric)
    def either(*args: Parameters.args, **options: Parameters.kwargs) -> Result:
        given: list[Any] = [*args, *options.values()]
        if any(map(_is_torch, given)):
            named = {name: as_array(value) for name, value in options.items()}
            found = metric(*[as_array(value) for value in args], **named)  # type: ignore[arg-type]
        else:
            found = metric(*args, **options)
        devices = [value.device for value in given if _is_tensor(value)]
        return _results(found, devices[0] if devices else None)

    return either


def as_array(value: Any) -> Any:
    """A tensor's numbers, a ground on arrays; anything else as it is."""
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


def _results(found: Any, device: Any) -> Any:
    """Arrays as tensors on the device, or as they are where that is None; what has no dimension as a number."""
    if isinstance(found, tuple):
        parts = [_results(part, device) for part in found]
        return type(found)(*parts) if hasattr(found, "_fields") else tuple(parts)
    if device is None:
        return found[()]
    import torch

    return torch.from_numpy(np.array(found)).to(device)
