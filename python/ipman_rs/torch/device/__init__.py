"""The path of tensors on GPUs and other devices, where it is tuned: the terms that a trainer needs every step.

No host synchronisation, no loop over bodies or parts, static shapes, sums in a fixed order; a first derivative by hand.
On CUDA with Triton installed the terms run in Triton kernels, elsewhere in a fixed chain of torch operations. Every
other quantity or list of terms takes the formulas in `reference`, as do forward mode, torch.func transforms and second
derivatives.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import torch
from torch import Tensor
from torch._C._functorch import is_functorch_wrapped_tensor

from ipman_rs.quantities import PAPER_TERMS, is_paper_terms, numbers_of

from .derivatives import Terms, WeightedTerms
from .stability_terms import NUMBERS

if TYPE_CHECKING:
    from ipman_rs import BodyTemplate
    from ipman_rs.quantities import Quantity


KNOWN = numbers_of(PAPER_TERMS) == NUMBERS
"""Whether the paper's terms have the numbers that the tuned path computes."""


def covers(quantity: Quantity, vertices: Tensor) -> bool:
    """Whether the tuned path computes this quantity of these vertices."""
    if not (KNOWN and is_paper_terms(quantity)):
        return False
    if torch.compiler.is_compiling():
        return True
    return not is_functorch_wrapped_tensor(vertices) and torch.autograd.forward_ad._current_level < 0


def values(template: BodyTemplate, quantity: Quantity, vertices: Tensor, normal: Tensor, height: Tensor) -> Tensor:
    """The terms (B, 3), each differentiable in vertices (B, V, 3); normal (B, 3) and height (B,) anywhere."""
    plane = normal.to(vertices.device), height.to(vertices.device)
    return Terms.apply(vertices, *plane, template, quantity)


def weighted(
    template: BodyTemplate,
    quantity: Quantity,
    vertices: Tensor,
    normal: Tensor,
    height: Tensor,
    weights: Tensor,
) -> tuple[Tensor, Tensor]:
    """Σ_k weights (B, 3) · terms (B,), differentiable, and the terms (B, 3), detached."""
    plane = normal.to(vertices.device), height.to(vertices.device)
    totals, terms = WeightedTerms.apply(vertices, *plane, weights, template, quantity)
    return totals, terms
