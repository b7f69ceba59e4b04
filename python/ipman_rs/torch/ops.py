"""The five verbs of the compiled core as dispatcher ops: torch.ops.ipman_rs.{value, vjp, jvp, hvp, value_and_vjp}.

vertices (B, V, 3) float32 or float64, normal (B, 3) and height (B,) float64, d_out (B, K) and d_vertices (B, V, 3) in
the dtype of vertices. A schema cannot carry an object, so a quantity of a template travels as `arguments` has it. These
ops have no autograd of their own: `autograd.py` wraps them. CPU only.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, Any

import torch
from torch import Tensor

from ipman_rs import _core
from ipman_rs.template import by_key

from .arrays import memory
from .folding import fold, unfold
from .threads import follow_torch

if TYPE_CHECKING:
    from ipman_rs import BodyTemplate
    from ipman_rs.quantities import Quantity

GROUND = "Tensor vertices, Tensor normal, Tensor height"
QUANTITY = "int template_key, str full_name, float[] options"

SCHEMAS = {
    "value": f"({GROUND}, {QUANTITY}) -> Tensor",
    "vjp": f"({GROUND}, Tensor d_out, {QUANTITY}) -> Tensor",
    "jvp": f"({GROUND}, Tensor d_vertices, {QUANTITY}) -> Tensor",
    "hvp": f"({GROUND}, Tensor d_out, Tensor d_vertices, {QUANTITY}) -> Tensor",
    "value_and_vjp": f"({GROUND}, Tensor d_out, {QUANTITY}) -> (Tensor, Tensor)",
}


def arguments(template: BodyTemplate, quantity: Quantity) -> tuple[int, str, list[float]]:
    """A quantity of a template as the ops take it: the template's key in this process, the name, the options."""
    return template._key, quantity.full_name, list(quantity.options)


def _handle(template_key: int, full_name: str, options: Sequence[float]) -> _core.Quantity:
    """The quantity of an op's arguments."""
    return _core.Quantity(by_key(template_key)._core, full_name, options)


def _compiled(verb: Callable[..., Any]) -> Callable[..., Any]:
    """The CPU implementation of an op: `verb` of the core's Quantity on the tensors' memory."""

    def implementation(*args: Any) -> Any:
        *tensors, template_key, full_name, options = args
        handle = _handle(template_key, full_name, options)
        follow_torch()
        result = verb(handle, *map(memory, tensors))
        if isinstance(result, tuple):
            return tuple(torch.from_numpy(array) for array in result)
        return torch.from_numpy(result)

    return implementation


def _fake_output(vertices: Tensor, normal: Tensor, height: Tensor, *rest: Any) -> Tensor:
    return vertices.new_empty(vertices.shape[0], _handle(*rest[-3:]).num_outputs)


def _fake_vertices(vertices: Tensor, *rest: Any) -> Tensor:
    return vertices.new_empty(vertices.shape)


def _fake_both(*args: Any) -> tuple[Tensor, Tensor]:
    return _fake_output(*args), _fake_vertices(*args)


FAKES: dict[str, Callable[..., Any]] = {
    "value": _fake_output,
    "vjp": _fake_vertices,
    "jvp": _fake_output,
    "hvp": _fake_vertices,
    "value_and_vjp": _fake_both,
}


def _batched(op: Callable[..., Any]) -> Callable[..., Any]:
    """The vmap rule of an op: one call with the mapped axis folded into the batch."""

    def rule(info: Any, in_dims: Sequence[int | None], *args: Any) -> tuple[Any, Any]:
        result = op(*fold(info.batch_size, in_dims, args))
        if isinstance(result, tuple):
            return tuple(unfold(info.batch_size, part) for part in result), (0,) * len(result)
        return unfold(info.batch_size, result), 0

    return rule


_library = torch.library.Library("ipman_rs", "FRAGMENT")
for _name, _schema in SCHEMAS.items():
    _library.define(_name + _schema, tags=(torch.Tag.pt2_compliant_tag,))
    _library.impl(_name, _compiled(getattr(_core.Quantity, _name)), "CPU")
    torch.library.register_fake(f"ipman_rs::{_name}", FAKES[_name], lib=_library)
    _op = getattr(torch.ops.ipman_rs, _name).default
    torch.library.register_vmap(f"ipman_rs::{_name}", _batched(_op), lib=_library)

value: Callable[..., Tensor] = torch.ops.ipman_rs.value.default
vjp: Callable[..., Tensor] = torch.ops.ipman_rs.vjp.default
jvp: Callable[..., Tensor] = torch.ops.ipman_rs.jvp.default
hvp: Callable[..., Tensor] = torch.ops.ipman_rs.hvp.default
value_and_vjp: Callable[..., tuple[Tensor, Tensor]] = torch.ops.ipman_rs.value_and_vjp.default
