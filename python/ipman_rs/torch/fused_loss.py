"""`IntuitivePhysicsLoss` as a trainer calls it: on the CPU, eager, in reverse mode. One call of the core each way.

All else (torch.compile, torch.func, forward mode, other devices) takes the general path of `dispatch.py`.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
import torch
from torch import Tensor
from torch._C._functorch import is_functorch_wrapped_tensor
from torch.autograd import Function, forward_ad

from ipman_rs import BodyTemplate
from ipman_rs.quantities import Quantity

from .arrays import memory
from .autograd import Vjp
from .ground import Ground
from .threads import follow_torch


class Call(NamedTuple):
    """The arguments of the core besides the bodies."""

    template: BodyTemplate
    quantity: Quantity
    weights: tuple[float, ...]
    reduction: str


def serves(vertices: Any) -> bool:
    """Whether these are CPU tensors that need a gradient, outside of compiled code, transforms and forward mode."""
    return (
        isinstance(vertices, Tensor)
        and vertices.requires_grad
        and vertices.is_cpu
        and vertices.is_floating_point()
        and torch.is_grad_enabled()
        and not torch.compiler.is_compiling()
        and forward_ad._current_level < 0
        and not torch._C._are_functorch_transforms_active()
    )


def _arrays(vertices: Tensor, ground: Ground) -> tuple[Any, Any, Any]:
    """Vertices (B, V, 3), and normal and height of one ground or of B."""
    normal = memory(ground.normal.to("cpu", torch.float64)).reshape(-1, 3)
    height = memory(ground.height.to("cpu", torch.float64)).reshape(-1)
    if len(normal) != len(height):
        batch = len(vertices)
        normal, height = np.broadcast_to(normal, (batch, 3)).copy(), np.broadcast_to(height, batch).copy()
    return memory(vertices), normal, height


class WeightedTotal(Function):
    """vertices (B, V, 3) -> Σ λ·term, reduced, or (B,); and the unweighted terms (K,) or (B, K), not differentiable.

    Value and gradient come from one pass. The gradient is cached; the backward multiplies it in place by the
    upstream gradient and returns it. A second backward, or one that is itself differentiated, computes it again.
    """

    @staticmethod
    def forward(ctx: Any, vertices: Tensor, ground: Ground, valid: Tensor | None, call: Call) -> tuple[Tensor, Tensor]:
        arrays = _arrays(vertices, ground)
        mask = memory(valid)
        follow_torch()
        handle = call.quantity.of(call.template)
        total, terms, shares, gradient = handle.weighted(*arrays, call.weights, mask, call.reduction)
        ctx.save_for_backward(vertices)
        ctx.call, ctx.ground, ctx.shares, ctx.gradient = call, arrays[1:], shares, gradient
        outputs = torch.from_numpy(total), torch.from_numpy(terms)
        ctx.mark_non_differentiable(outputs[1])
        ctx.set_materialize_grads(False)
        return outputs

    @staticmethod
    def backward(ctx: Any, d_total: Tensor | None, *_: Any) -> tuple[Tensor | None, None, None, None]:
        if d_total is None:
            return None, None, None, None
        gradient, ctx.gradient = ctx.gradient, None
        if gradient is None or _is_differentiated(d_total):
            (vertices,) = ctx.saved_tensors
            d_bodies = d_total * torch.from_numpy(ctx.shares)
            return _vjp(ctx, vertices, d_bodies[:, None] * vertices.new_tensor(ctx.call.weights)), None, None, None
        if d_total.ndim:
            gradient *= d_total.numpy(force=True)[:, None, None]
        elif (scale := d_total.item()) != 1:
            gradient *= scale
        return torch.from_numpy(gradient), None, None, None


class Terms(Function):
    """vertices (B, V, 3) -> terms (K,), reduced, or (B, K).

    The forward keeps the Jacobian, from which a backward with any upstream gradient follows. It has three numbers per
    vertex for each term, and one for each whose gradient is along the ground's normal, as those of pull and push are.
    """

    @staticmethod
    def forward(ctx: Any, vertices: Tensor, ground: Ground, valid: Tensor | None, call: Call) -> Tensor:
        arrays = _arrays(vertices, ground)
        mask = memory(valid)
        follow_torch()
        terms, shares, jacobian = call.quantity.of(call.template).terms(*arrays, mask, call.reduction)
        ctx.save_for_backward(vertices)
        ctx.call, ctx.ground, ctx.shares, ctx.jacobian = call, arrays[1:], shares, jacobian
        return torch.from_numpy(terms)

    @staticmethod
    def backward(ctx: Any, d_terms: Tensor) -> tuple[Tensor, None, None, None]:
        (vertices,) = ctx.saved_tensors  # raises if vertices were changed in place
        if _is_differentiated(d_terms):
            return _vjp(ctx, vertices, torch.from_numpy(ctx.shares)[:, None] * d_terms), None, None, None
        follow_torch()
        handle = ctx.call.quantity.of(ctx.call.template)
        gradient = handle.terms_backward(ctx.jacobian, ctx.shares, memory(d_terms), ctx.ground[0])
        return torch.from_numpy(gradient), None, None, None


def _is_differentiated(upstream: Tensor) -> bool:
    """Whether the backward is itself part of a graph or of a transform."""
    return torch.is_grad_enabled() or is_functorch_wrapped_tensor(upstream)


def _vjp(ctx: Any, vertices: Tensor, d_out: Tensor) -> Tensor:
    """The gradient by operations that can be differentiated once more."""
    normal, height = (torch.from_numpy(given).expand(len(vertices), *given.shape[1:]) for given in ctx.ground)
    return Vjp.apply(vertices, normal, height, d_out, ctx.call.template, ctx.call.quantity)
