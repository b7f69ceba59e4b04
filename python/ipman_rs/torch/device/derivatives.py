"""The tuned terms as differentiable functions: the first derivative by hand, the second by the reference formula."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import torch
from torch import Tensor
from torch.autograd import Function

from .. import reference
from . import triton_terms
from .stability_terms import StabilityOptions
from .stability_terms import values as torch_values
from .stability_terms import values_and_gradient as torch_values_and_gradient
from .tables import tables

if TYPE_CHECKING:
    from ipman_rs import BodyTemplate
    from ipman_rs.quantities import Quantity

Problem = tuple["BodyTemplate", "Quantity"]


class Terms(Function):
    """vertices (B, V, 3), normal (B, 3), height (B,) -> values (B, 3). The backward computes forward once more."""

    @staticmethod
    def forward(
        ctx: Any,
        vertices: Tensor,
        normal: Tensor,
        height: Tensor,
        template: BodyTemplate,
        quantity: Quantity,
    ) -> Tensor:
        ctx.save_for_backward(vertices, normal, height)
        ctx.problem = (template, quantity)
        return _values(ctx.problem, vertices, normal, height)

    @staticmethod
    def backward(ctx: Any, d_out: Tensor) -> tuple[Tensor | None, ...]:
        vertices, normal, height = ctx.saved_tensors
        if _needs_graph():
            gradient = _reference_gradient(ctx.problem, vertices, normal, height, d_out)
        else:
            gradient = _values_and_gradient(ctx.problem, vertices, normal, height, d_out)[1]
        return gradient, None, None, None, None


class WeightedTerms(Function):
    """As `Terms`, with weights (B, 3) -> Σ weights · values (B,) and values (B, 3), which are not differentiable.

    Values and gradient come from one pass; the backward scales.
    """

    @staticmethod
    def forward(
        ctx: Any,
        vertices: Tensor,
        normal: Tensor,
        height: Tensor,
        weights: Tensor,
        template: BodyTemplate,
        quantity: Quantity,
    ) -> tuple[Tensor, Tensor]:
        ctx.problem = (template, quantity)
        values, gradient = _values_and_gradient(ctx.problem, vertices, normal, height, weights)
        ctx.save_for_backward(vertices, normal, height, weights, gradient)
        ctx.mark_non_differentiable(values)
        return (values * weights).sum(dim=-1), values

    @staticmethod
    def backward(ctx: Any, d_totals: Tensor, *_: Any) -> tuple[Tensor | None, ...]:
        vertices, normal, height, weights, gradient = ctx.saved_tensors
        if _needs_graph():
            scaled = _reference_gradient(ctx.problem, vertices, normal, height, weights * d_totals[:, None])
        else:
            scaled = gradient * d_totals[:, None, None]
        return scaled, None, None, None, None, None


def _values(problem: Problem, vertices: Tensor, normal: Tensor, height: Tensor) -> Tensor:
    template, quantity = problem
    curve, options = quantity.modes[-1], quantity.options
    if triton_terms.serves(vertices):
        return triton_terms.values(vertices, normal, height, template._key, curve, options)
    known = tables(template, vertices.device, vertices.dtype)
    return torch_values(known, StabilityOptions(*options), curve, vertices, normal, height)


def _values_and_gradient(
    problem: Problem, vertices: Tensor, normal: Tensor, height: Tensor, weights: Tensor
) -> tuple[Tensor, Tensor]:
    template, quantity = problem
    curve, options = quantity.modes[-1], quantity.options
    if triton_terms.serves(vertices):
        return triton_terms.values_and_gradient(vertices, normal, height, weights, template._key, curve, options)
    known = tables(template, vertices.device, vertices.dtype)
    return torch_values_and_gradient(known, StabilityOptions(*options), curve, vertices, normal, height, weights)


def _needs_graph() -> bool:
    """Whether this backward is itself differentiated (create_graph=True). Compiled code never is."""
    return not torch.compiler.is_compiling() and torch.is_grad_enabled()


def _reference_gradient(problem: Problem, vertices: Tensor, normal: Tensor, height: Tensor, d_out: Tensor) -> Tensor:
    """The same gradient with a graph of its own, through the reference formula."""
    values = reference.evaluate(*problem, vertices, normal.to(vertices), height.to(vertices))
    (gradient,) = torch.autograd.grad(values, vertices, d_out, create_graph=True)
    return gradient
