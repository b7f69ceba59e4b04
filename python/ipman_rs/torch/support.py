"""Base of support: hull, containment, and the margin with its gradient."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import torch
from torch import Tensor

import ipman_rs as ip
from ipman_rs import BaseOfSupport, BodyTemplate, quantities
from ipman_rs import Ground as NumpyGround
from ipman_rs.checks import choice
from ipman_rs.quantities import Contact, Method
from ipman_rs.support import Solver

from .arrays import as_array, dense
from .dispatch import evaluate
from .ground import Ground, as_numpy_ground


def support_margin(
    vertices: Tensor,
    template: BodyTemplate,
    ground: Ground | NumpyGround,
    threshold: float = 0.1,
    method: Method = "pcom",
    contact: Contact = "paper",
) -> Tensor:
    """Metres from the CoM to the boundary of the base of support, positive inside: vertices (..., V, 3) -> (...).

    −inf, with gradient 0, without contact. The gradient goes to the CoM and to the samples that span the nearest edge.
    contact: "paper" |h| < τ, or "released" h < τ where ten contacts or fewer count for none.

    Raises:
        ValueError: wrong shapes, a ground that does not fit the batch, an option out of its range, or an unknown word.
        TypeError: vertices is no ordinary floating-point tensor, or an argument is of the wrong kind.
    """
    return evaluate(vertices, template, ground, quantities.support_margin(threshold, method, contact))


def base_of_support(
    vertices: Tensor,
    template: BodyTemplate,
    ground: Ground | NumpyGround,
    threshold: float = 0.1,
    method: Method = "pcom",
    contact: Contact = "paper",
) -> BaseOfSupport:
    """`ipman_rs.base_of_support` with tensors in its fields, on the device of vertices; `margin` is differentiable.

    Raises:
        As `support_margin`.
    """
    base = ip.base_of_support(as_array(vertices), template, as_numpy_ground(ground), threshold, method, contact)

    def tensors(value: Any) -> Any:
        if isinstance(value, list):
            return [tensors(entry) for entry in value]
        tensor = torch.as_tensor(value, device=vertices.device)
        return tensor.to(vertices.dtype) if tensor.is_floating_point() else tensor

    on_device = replace(base, **{name: tensors(value) for name, value in vars(base).items()})
    return replace(on_device, margin=support_margin(vertices, template, ground, threshold, method, contact))


def bose(
    vertices: Tensor,
    template: BodyTemplate,
    ground: Ground | NumpyGround,
    threshold: float = 0.1,
    method: Solver = "hull",
    com_method: Method = "pcom",
    contact: Contact = "paper",
) -> Tensor:
    """Whether the CoM lies over the base of support (Eq. 10): vertices (..., V, 3) -> bool (...); not differentiable.

    "hull" is margin >= 0, on any device; "lp" is the paper's linear programme, solved on the CPU.

    Raises:
        As `support_margin`; ValueError also for an unknown method.
    """
    if choice("method", method, Solver) == "hull":
        still = dense("vertices", vertices).detach()
        return support_margin(still, template, ground, threshold, com_method, contact) >= 0
    inside = ip.bose(as_array(vertices), template, as_numpy_ground(ground), threshold, "lp", com_method, contact)
    return torch.as_tensor(inside, device=vertices.device)
