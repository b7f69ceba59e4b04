"""What a body's contact with itself costs, differentiable once, in reverse mode.

The op gives the gradients of push and pull beside them; `_Costs` keeps these for its backward.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import torch
from torch import Tensor
from torch.autograd import Function

from ipman_rs import BodyTemplate
from ipman_rs.checks import not_negative
from ipman_rs.self_contact import checked, collision
from ipman_rs.template import by_key

from . import dispatch
from .folding import fold, unfold
from .reference.self_contact import self_contact_loss as by_plain_torch
from .threads import follow_torch

SECOND = "self_contact_loss: second derivatives are not implemented; the first are there in reverse mode"


def self_contact_loss(
    vertices: Tensor,
    template: BodyTemplate,
    push_width: float = 0.04,
    pull_width: float = 0.005,
    pull_weight: float = 0.005,
    near: float = 0.02,
    geodesic: float = 0.3,
) -> tuple[Tensor, Tensor]:
    """(push, pull), each (...): ½ Σ tanh²(d / push_width) over the vertices inside another part of the body, and
    ½ pull_weight Σ tanh²(d / pull_width) over those outside that are nearer than `near` to opposite surface.

    d is the distance to the nearest opposite point. Which vertices are inside and which face is nearest is decided anew
    for every pose and not differentiated. First derivatives in reverse mode only.

    Args:
        vertices: (..., V, 3) m.
        push_width, pull_width, near: m.
        geodesic: m; surface nearer than this to a vertex along the template is not opposite to it.

    Raises:
        ValueError: wrong shape, or an option out of its range.
        TypeError: vertices is no ordinary floating-point tensor, or an argument is of the wrong kind.
        NotImplementedError: a second derivative is asked for.
    """
    options = checked(push_width, pull_width, pull_weight, near)
    geodesic = not_negative("geodesic", geodesic)
    batch = dispatch.bodies(vertices, template, None)
    if dispatch.forced() or batch.vertices.device.type != "cpu":
        costs = torch.stack(by_plain_torch(batch.vertices, template, *options, geodesic=geodesic), dim=-1)
    else:
        costs = _Costs.apply(batch.vertices, template, geodesic, options)[0]
    push, pull = costs.reshape(*batch.batch_shape, 2).to(vertices.dtype).unbind(dim=-1)
    return push, pull


class _Costs(Function):
    """vertices (B, V, 3) -> costs (B, 2) and their gradients (B, 2, V, 3), the latter not differentiable."""

    @staticmethod
    def forward(vertices: Tensor, template: BodyTemplate, geodesic: float, options: list[float]) -> Any:
        return torch.ops.ipman_rs.self_contact(vertices, template._key, geodesic, options)

    @staticmethod
    def setup_context(ctx: Any, inputs: tuple[Any, ...], output: tuple[Tensor, Tensor]) -> None:
        ctx.save_for_backward(inputs[0], output[1])
        ctx.mark_non_differentiable(output[1])

    @staticmethod
    def backward(ctx: Any, d_costs: Tensor, _: Any) -> tuple[Tensor, None, None, None]:
        vertices, jacobian = ctx.saved_tensors
        return _Gradient.apply(vertices, jacobian, d_costs), None, None, None

    @staticmethod
    def vmap(info: Any, in_dims: Sequence[int | None], *args: Any) -> Any:
        outputs = _Costs.apply(*fold(info.batch_size, in_dims, args))
        return tuple(unfold(info.batch_size, output) for output in outputs), (0, 0)


class _Gradient(Function):
    """The gradients (B, 2, V, 3) put together by d_costs (B, 2). It knows the vertices in order to refuse by them."""

    @staticmethod
    def forward(vertices: Tensor, jacobian: Tensor, d_costs: Tensor) -> Tensor:
        push, pull = (d_costs[:, k, None, None] * jacobian[:, k] for k in range(2))
        return push + pull

    @staticmethod
    def setup_context(ctx: Any, inputs: tuple[Any, ...], output: Tensor) -> None:
        pass

    @staticmethod
    def backward(ctx: Any, *_: Any) -> Any:
        raise NotImplementedError(SECOND)

    @staticmethod
    def vmap(info: Any, in_dims: Sequence[int | None], *args: Any) -> tuple[Tensor, int]:
        return unfold(info.batch_size, _Gradient.apply(*fold(info.batch_size, in_dims, args))), 0


def _on_core(vertices: Tensor, template_key: int, geodesic: float, options: list[float]) -> tuple[Tensor, Tensor]:
    tables = collision(by_key(template_key), geodesic)
    follow_torch()
    costs, jacobian = tables.self_contact(vertices.contiguous().numpy(force=True), options)
    return torch.from_numpy(costs), torch.from_numpy(jacobian)


_library = torch.library.Library("ipman_rs", "FRAGMENT")
_library.define(
    "self_contact(Tensor vertices, int template_key, float geodesic, float[] options) -> (Tensor, Tensor)",
    tags=(torch.Tag.pt2_compliant_tag,),
)
_library.impl("self_contact", _on_core, "CPU")


@torch.library.register_fake("ipman_rs::self_contact", lib=_library)
def _(vertices: Tensor, *_: Any) -> tuple[Tensor, Tensor]:
    batch, count, _three = vertices.shape
    return vertices.new_empty(batch, 2), vertices.new_empty(batch, 2, count, 3)
