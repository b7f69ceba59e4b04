"""The weighted total of a training step on the CPU: value and gradient in one call of the core.

This is `IntuitivePhysicsLoss.weighted` as a trainer calls it, eager and in reverse mode. Anything else (torch.compile,
torch.func, forward mode, other devices) takes the general path in `dispatch.py`.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import torch
from torch import Tensor
from torch._C._functorch import is_functorch_wrapped_tensor
from torch.autograd import Function, forward_ad

from ipman_rs import BodyTemplate, _core

from .autograd import Vjp
from .ground import Ground
from .threads import follow_torch


class Call(NamedTuple):
    """What is asked of the core besides the bodies."""

    template: BodyTemplate
    quantity: str
    options: tuple[float, ...]
    weights: tuple[float, ...]
    reduction: str


def serves(vertices: Any) -> bool:
    """Whether these vertices (B, V, 3) ask for a gradient in a way that one pass can give."""
    return (
        isinstance(vertices, Tensor)
        and vertices.requires_grad
        and vertices.device.type == "cpu"
        and vertices.dtype in (torch.float32, torch.float64)
        and torch.is_grad_enabled()
        and not torch.compiler.is_compiling()
        and forward_ad._current_level < 0
        and not is_functorch_wrapped_tensor(vertices)
    )


class OnePass(Function):
    """vertices -> total (or totals (B,)), terms (K,) or (B, K). The terms are not differentiable.

    The gradient waits for the backward, which scales it by its upstream in place and hands it over; a second backward,
    or one that is itself differentiated, computes it again by differentiable operations.
    """

    @staticmethod
    def forward(
        ctx: Any, vertices: Tensor, ground: Ground, valid: Tensor | None, call: Call
    ) -> tuple[Tensor, Tensor]:
        normal, height = ground.normal.reshape(-1, 3), ground.height.reshape(-1)
        if len(normal) != len(height):
            normal, height = (given.expand(len(vertices), *given.shape[1:]) for given in (normal, height))
        follow_torch()
        total, terms, shares, gradient = _core.weighted(
            call.template._core,
            call.quantity,
            call.options,
            vertices.detach().contiguous().numpy(),
            normal.to("cpu", torch.float64).contiguous().numpy(),
            height.to("cpu", torch.float64).contiguous().numpy(),
            call.weights,
            None if valid is None else valid.numpy(force=True),
            call.reduction,
        )
        ctx.save_for_backward(vertices)
        ctx.call, ctx.ground, ctx.shares = call, (normal, height), shares
        ctx.gradient = gradient
        outputs = torch.from_numpy(total), torch.from_numpy(terms)
        ctx.mark_non_differentiable(outputs[1])
        ctx.set_materialize_grads(False)
        return outputs

    @staticmethod
    def backward(ctx: Any, d_total: Tensor | None, *_: Any) -> tuple[Tensor | None, None, None, None]:
        if d_total is None:
            return None, None, None, None
        gradient, ctx.gradient = ctx.gradient, None
        if gradient is None or torch.is_grad_enabled() or is_functorch_wrapped_tensor(d_total):
            return _differentiable(ctx, d_total), None, None, None
        if d_total.ndim:
            gradient *= d_total.numpy(force=True)[:, None, None]
        elif (scale := d_total.item()) != 1:
            gradient *= scale
        return torch.from_numpy(gradient), None, None, None


def _differentiable(ctx: Any, d_total: Tensor) -> Tensor:
    """The gradient by operations that can be differentiated once more."""
    (vertices,) = ctx.saved_tensors
    template, quantity, options, weights, _ = ctx.call
    normal, height = (given.expand(len(vertices), *given.shape[1:]) for given in ctx.ground)
    d_bodies = d_total * torch.from_numpy(ctx.shares)
    d_out = d_bodies[:, None] * vertices.new_tensor(weights)
    return Vjp.apply(vertices, normal, height, d_out, template, quantity, list(options))
