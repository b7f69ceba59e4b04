"""Derivatives of the ops: which op implements which derivative, eager and compiled.

    out = f(V)          reverse: vjp(V, d_out)                forward: jvp(V, d_vertices)
    g = vjp(V, d_out)   reverse: jvp and hvp                  forward: hvp + vjp
    t = jvp(V, d_V)     reverse: hvp and vjp

The Hessian of Σ d_out · out is symmetric, so hvp serves both modes. Third derivatives are refused. Dynamo takes no
Function that defines `jvp`, so compiled code gets classes of its own, differentiable once.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from torch import Tensor
from torch.autograd import Function

from . import ops
from .folding import fold, unfold

THIRD = "third derivatives (and forward over forward) are not implemented; use jacfwd(jacrev(f)) for a Hessian"


class _Op(Function):
    """What the eager Functions share. Inputs: tensors, then (template, quantity).

    The template itself travels, not its key, so that it lives until the backward.
    """

    @staticmethod
    def setup_context(ctx: Any, inputs: tuple[Any, ...], output: Any) -> None:
        *tensors, template, quantity = inputs
        ctx.save_for_backward(*tensors)
        ctx.save_for_forward(*tensors)
        ctx.quantity = (template, quantity)

    @classmethod
    def vmap(cls, info: Any, in_dims: Sequence[int | None], *args: Any) -> tuple[Tensor, int]:
        return unfold(info.batch_size, cls.apply(*fold(info.batch_size, in_dims, args))), 0


class Value(_Op):
    """f(V): vertices, normal, height -> (B, K)."""

    @staticmethod
    def forward(*args: Any) -> Tensor:
        *tensors, template, quantity = args
        return ops.value(*tensors, *ops.arguments(template, quantity))

    @staticmethod
    def backward(ctx: Any, d_out: Tensor) -> tuple[Tensor | None, ...]:
        return Vjp.apply(*ctx.saved_tensors, d_out, *ctx.quantity), None, None, None, None

    @staticmethod
    def jvp(ctx: Any, d_vertices: Tensor, *_: Any) -> Tensor:
        return Jvp.apply(*ctx.saved_tensors, d_vertices, *ctx.quantity)


class Vjp(_Op):
    """vertices, normal, height, d_out -> Jᵀ d_out (B, V, 3)."""

    @staticmethod
    def forward(*args: Any) -> Tensor:
        *tensors, template, quantity = args
        return ops.vjp(*tensors, *ops.arguments(template, quantity))

    @staticmethod
    def backward(ctx: Any, d_gradient: Tensor) -> tuple[Tensor | None, ...]:
        vertices, normal, height, d_out = ctx.saved_tensors
        hessian_product = Hvp.apply(vertices, normal, height, d_out, d_gradient, *ctx.quantity)
        d_d_out = Jvp.apply(vertices, normal, height, d_gradient, *ctx.quantity)
        return hessian_product, None, None, d_d_out, None, None

    @staticmethod
    def jvp(ctx: Any, d_vertices: Tensor, _normal: Any, _height: Any, d_d_out: Tensor, *_: Any) -> Tensor:
        vertices, normal, height, d_out = ctx.saved_tensors
        along_vertices = Hvp.apply(vertices, normal, height, d_out, d_vertices, *ctx.quantity)
        return along_vertices + Vjp.apply(vertices, normal, height, d_d_out, *ctx.quantity)


class Jvp(_Op):
    """vertices, normal, height, d_vertices -> J d_vertices (B, K)."""

    @staticmethod
    def forward(*args: Any) -> Tensor:
        *tensors, template, quantity = args
        return ops.jvp(*tensors, *ops.arguments(template, quantity))

    @staticmethod
    def backward(ctx: Any, d_out: Tensor) -> tuple[Tensor | None, ...]:
        vertices, normal, height, d_vertices = ctx.saved_tensors
        hessian_product = Hvp.apply(vertices, normal, height, d_out, d_vertices, *ctx.quantity)
        return hessian_product, None, None, Vjp.apply(vertices, normal, height, d_out, *ctx.quantity), None, None

    @staticmethod
    def jvp(ctx: Any, *_: Any) -> Tensor:
        raise NotImplementedError(THIRD)


class Hvp(_Op):
    """vertices, normal, height, d_out, d_vertices -> Hessian of d_out · f times d_vertices (B, V, 3)."""

    @staticmethod
    def forward(*args: Any) -> Tensor:
        *tensors, template, quantity = args
        return ops.hvp(*tensors, *ops.arguments(template, quantity))

    @staticmethod
    def backward(ctx: Any, *_: Any) -> Any:
        raise NotImplementedError(THIRD)

    @staticmethod
    def jvp(ctx: Any, *_: Any) -> Tensor:
        raise NotImplementedError(THIRD)


class CompiledValue(Function):
    """`Value` for torch.compile."""

    @staticmethod
    def forward(
        ctx: Any, vertices: Tensor, normal: Tensor, height: Tensor, key: int, name: str, options: list[float]
    ) -> Tensor:
        ctx.save_for_backward(vertices, normal, height)
        ctx.quantity = (key, name, options)
        return ops.value(vertices, normal, height, key, name, options)

    @staticmethod
    def backward(ctx: Any, d_out: Tensor) -> tuple[Tensor | None, ...]:
        return ops.vjp(*ctx.saved_tensors, d_out, *ctx.quantity), None, None, None, None, None


class CompiledWeighted(Function):
    """One pass for torch.compile: vertices, normal, height, weights (B, K) -> totals (B,), values (B, K).

    Only the totals Σ_k weights · values are differentiable. Their gradient comes along; the backward scales it.
    """

    @staticmethod
    def forward(
        ctx: Any,
        vertices: Tensor,
        normal: Tensor,
        height: Tensor,
        weights: Tensor,
        key: int,
        name: str,
        options: list[float],
    ) -> tuple[Tensor, Tensor]:
        values, gradient = ops.value_and_vjp(vertices, normal, height, weights, key, name, options)
        ctx.save_for_backward(gradient)
        ctx.mark_non_differentiable(values)
        return (values * weights).sum(dim=-1), values

    @staticmethod
    def backward(ctx: Any, d_totals: Tensor, *_: Any) -> tuple[Tensor | None, ...]:
        (gradient,) = ctx.saved_tensors
        return gradient * d_totals[:, None, None], None, None, None, None, None, None
