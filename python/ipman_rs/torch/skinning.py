"""Linear blend skinning as dispatcher ops, torch.ops.ipman_rs.skin{,_vjp,_jvp,_vjp_jvp}, and their derivatives.

    vertices, joints = f(θ)      reverse: vjp(θ, u)               forward: jvp(θ, a)
    g = vjp(θ, u)                reverse: vjp_jvp and jvp         forward: vjp_jvp + vjp
    t = jvp(θ, a)                reverse: vjp_jvp and vjp

θ is pose (B, J, 3 or 6), betas (B, k), expression (B, k) and transl (B, 3), all of one dtype, float32 or float64; any
but the pose may be None. u is the gradient by vertices and joints, a direction in θ's space is four tensors like θ;
None is zero. `needs` has a bit for each gradient that is asked for. The body travels as its process-wide key. CPU only.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
import torch
from torch import Tensor
from torch.autograd import Function

from ipman_rs.body.model import by_key

from .arrays import memory
from .autograd import THIRD
from .folding import fold, unfold
from .threads import follow_torch

if TYPE_CHECKING:
    from ipman_rs.body import BodyModel

Four = Sequence[Tensor | None]

PARAMETERS = "Tensor pose, Tensor? betas, Tensor? expression, Tensor? transl"
ALONG = "Tensor? along_pose, Tensor? along_betas, Tensor? along_expression, Tensor? along_transl"
UPSTREAM = "Tensor? d_vertices, Tensor? d_joints"

SCHEMAS = {
    "skin": f"({PARAMETERS}, int body_key) -> (Tensor, Tensor)",
    "skin_vjp": f"({PARAMETERS}, {UPSTREAM}, int needs, int body_key) -> (Tensor, Tensor, Tensor, Tensor)",
    "skin_jvp": f"({PARAMETERS}, {ALONG}, int body_key) -> (Tensor, Tensor)",
    "skin_vjp_jvp": f"({PARAMETERS}, {UPSTREAM}, {ALONG}, int needs, int body_key) -> (Tensor, Tensor, Tensor, Tensor)",
}


def _skin(*args: Any) -> tuple[Tensor, Tensor]:
    *parameters, key = args
    vertices, joints = _outputs(*args)
    core = _core_of(key, parameters[0])
    core.forward(len(vertices), _arrays(parameters), vertices.numpy(), joints.numpy())
    return vertices, joints


def _skin_vjp(*args: Any) -> tuple[Tensor, ...]:
    parameters, (d_vertices, d_joints, needs, key) = args[:4], args[4:]
    gradients = _gradients(parameters, needs)
    core = _core_of(key, parameters[0])
    upstream = memory(d_vertices), memory(d_joints)
    core.vjp(len(parameters[0]), _arrays(parameters), *upstream, _written(gradients))
    return gradients


def _skin_jvp(*args: Any) -> tuple[Tensor, Tensor]:
    parameters, along, key = args[:4], args[4:8], args[8]
    vertices, joints = _outputs(*parameters, key)
    core = _core_of(key, parameters[0])
    core.jvp(len(vertices), _arrays(parameters), _arrays(along), vertices.numpy(), joints.numpy())
    return vertices, joints


def _skin_vjp_jvp(*args: Any) -> tuple[Tensor, ...]:
    parameters, (d_vertices, d_joints), along, (needs, key) = args[:4], args[4:6], args[6:10], args[10:]
    gradients = _gradients(parameters, needs)
    core = _core_of(key, parameters[0])
    upstream = memory(d_vertices), memory(d_joints)
    core.vjp_jvp(len(parameters[0]), _arrays(parameters), *upstream, _arrays(along), _written(gradients))
    return gradients


def _core_of(key: int, pose: Tensor) -> Any:
    """The compiled body of that key in the pose's dtype."""
    follow_torch()
    return by_key(key)._skin(np.float32 if pose.dtype == torch.float32 else np.float64)


def _arrays(tensors: Four) -> tuple[Any, Any, Any, Any]:
    """The tensors' memory; a parameter that was expanded over the batch is passed once."""
    rows = (
        tensor[:1] if tensor is not None and len(tensor) and tensor.stride(0) == 0 else tensor for tensor in tensors
    )
    pose, betas, expression, transl = map(memory, rows)
    return pose, betas, expression, transl


def _outputs(*args: Any) -> tuple[Tensor, Tensor]:
    pose, body = args[0], by_key(args[-1])
    return pose.new_empty(len(pose), body.num_vertices, 3), pose.new_empty(len(pose), body.num_joints, 3)


def _gradients(parameters: Four, needs: int) -> tuple[Tensor, Tensor, Tensor, Tensor]:
    """Memory for the gradients, (B, 0) for what is not asked for."""
    first = parameters[0]
    assert first is not None
    pose, betas, expression, transl = (
        first.new_empty(len(first), 0) if value is None or not needs >> bit & 1 else value.new_empty(value.shape)
        for bit, value in enumerate(parameters)
    )
    return pose, betas, expression, transl


def _written(gradients: Sequence[Tensor]) -> tuple[Any, Any, Any, Any]:
    pose, betas, expression, transl = (gradient.numpy() if gradient.numel() else None for gradient in gradients)
    return pose, betas, expression, transl


def _fake_gradients(*args: Any) -> tuple[Tensor, Tensor, Tensor, Tensor]:
    return _gradients(args[:4], args[-2])


def _batched(op: Callable[..., Any]) -> Callable[..., Any]:
    """The vmap rule of an op: one call with the mapped axis folded into the batch."""

    def rule(info: Any, in_dims: Sequence[int | None], *args: Any) -> tuple[Any, Any]:
        result = op(*fold(info.batch_size, in_dims, args))
        return tuple(unfold(info.batch_size, part) for part in result), (0,) * len(result)

    return rule


_library = torch.library.Library("ipman_rs", "FRAGMENT")
for _name, _implementation, _fake in (
    ("skin", _skin, _outputs),
    ("skin_vjp", _skin_vjp, _fake_gradients),
    ("skin_jvp", _skin_jvp, _outputs),
    ("skin_vjp_jvp", _skin_vjp_jvp, _fake_gradients),
):
    _library.define(_name + SCHEMAS[_name], tags=(torch.Tag.pt2_compliant_tag,))
    _library.impl(_name, _implementation, "CPU")
    torch.library.register_fake(f"ipman_rs::{_name}", _fake, lib=_library)
    _op = getattr(torch.ops.ipman_rs, _name).default
    torch.library.register_vmap(f"ipman_rs::{_name}", _batched(_op), lib=_library)

skin: Callable[..., tuple[Tensor, Tensor]] = torch.ops.ipman_rs.skin.default
skin_vjp: Callable[..., tuple[Tensor, ...]] = torch.ops.ipman_rs.skin_vjp.default
skin_jvp: Callable[..., tuple[Tensor, Tensor]] = torch.ops.ipman_rs.skin_jvp.default
skin_vjp_jvp: Callable[..., tuple[Tensor, ...]] = torch.ops.ipman_rs.skin_vjp_jvp.default


def _mask(needed: Sequence[bool], values: Sequence[Any]) -> int:
    return sum(
        1 << bit for bit, (need, value) in enumerate(zip(needed, values, strict=True)) if need and value is not None
    )


def _asked(gradients: Sequence[Tensor | None], needs: int) -> list[Tensor | None]:
    """None in the place of a gradient that was not asked for."""
    return [gradient if needs >> bit & 1 else None for bit, gradient in enumerate(gradients)]


class _Op(Function):
    """What the eager Functions share. Inputs: tensors or None, then `needs` (but for `Skin` and `Jvp`) and the body.

    The body itself travels, not its key, so that it lives until the backward.
    """

    @staticmethod
    def setup_context(ctx: Any, inputs: tuple[Any, ...], output: Any) -> None:
        tensors = [value for value in inputs if value is None or isinstance(value, Tensor)]
        ctx.save_for_backward(*tensors)
        ctx.save_for_forward(*tensors)
        ctx.rest = inputs[len(tensors) :]
        ctx.set_materialize_grads(False)

    @classmethod
    def vmap(cls, info: Any, in_dims: Sequence[int | None], *args: Any) -> tuple[tuple[Tensor, ...], tuple[int, ...]]:
        outputs = cls.apply(*fold(info.batch_size, in_dims, args))
        return tuple(unfold(info.batch_size, output) for output in outputs), (0,) * len(outputs)


class Skin(_Op):
    """pose, betas, expression, transl, body -> vertices (B, V, 3), joints (B, J, 3)."""

    @staticmethod
    def forward(*args: Any) -> tuple[Tensor, Tensor]:
        *parameters, body = args
        return skin(*parameters, body._key)

    @staticmethod
    def backward(ctx: Any, *upstream: Tensor | None) -> tuple[Tensor | None, ...]:
        parameters, (body,) = ctx.saved_tensors, ctx.rest
        needs = _mask(ctx.needs_input_grad[:4], parameters)
        return *_asked(Vjp.apply(*parameters, *upstream, needs, body), needs), None

    @staticmethod
    def jvp(ctx: Any, *along: Tensor | None) -> tuple[Tensor, Tensor]:
        return Jvp.apply(*ctx.saved_tensors, *along[:4], *ctx.rest)


class Vjp(_Op):
    """Parameters, d_vertices, d_joints, needs, body -> the gradients that are needed."""

    @staticmethod
    def forward(*args: Any) -> tuple[Tensor, ...]:
        *tensors, needs, body = args
        return skin_vjp(*tensors, needs, body._key)

    @staticmethod
    def backward(ctx: Any, *d_gradients: Tensor | None) -> tuple[Tensor | None, ...]:
        *parameters, d_vertices, d_joints = ctx.saved_tensors
        needs, body = ctx.rest
        along = _asked(d_gradients, needs)
        wanted = _mask(ctx.needs_input_grad[:4], parameters)
        products = _asked(VjpJvp.apply(*parameters, d_vertices, d_joints, *along, wanted, body), wanted)
        d_upstream: Sequence[Tensor | None] = (None, None)
        if any(ctx.needs_input_grad[4:6]):
            both = Jvp.apply(*parameters, *along, body)
            d_upstream = [d if need else None for d, need in zip(both, ctx.needs_input_grad[4:6], strict=True)]
        return *products, *d_upstream, None, None

    @staticmethod
    def jvp(ctx: Any, *tangents: Tensor | None) -> tuple[Tensor, ...]:
        *parameters, d_vertices, d_joints = ctx.saved_tensors
        needs, body = ctx.rest
        along, d_upstream = tangents[:4], tangents[4:6]
        result = VjpJvp.apply(*parameters, d_vertices, d_joints, *along, needs, body)
        if any(d is not None for d in d_upstream):
            more = Vjp.apply(*parameters, *d_upstream, needs, body)
            result = tuple(a + b for a, b in zip(result, more, strict=True))
        return result


class Jvp(_Op):
    """Parameters, a direction in their space, body -> derivatives of vertices and joints."""

    @staticmethod
    def forward(*args: Any) -> tuple[Tensor, Tensor]:
        *tensors, body = args
        return skin_jvp(*tensors, body._key)

    @staticmethod
    def backward(ctx: Any, *upstream: Tensor | None) -> tuple[Tensor | None, ...]:
        tensors, (body,) = ctx.saved_tensors, ctx.rest
        parameters, along = tensors[:4], tensors[4:]
        wanted = _mask(ctx.needs_input_grad[:4], parameters)
        products = _asked(VjpJvp.apply(*parameters, *upstream, *along, wanted, body), wanted)
        wanted = _mask(ctx.needs_input_grad[4:8], along)
        return *products, *_asked(Vjp.apply(*parameters, *upstream, wanted, body), wanted), None

    @staticmethod
    def jvp(ctx: Any, *_: Any) -> Any:
        raise NotImplementedError(THIRD)


class VjpJvp(_Op):
    """Parameters, d_vertices, d_joints, a direction, needs, body -> the gradients' derivatives along the direction."""

    @staticmethod
    def forward(*args: Any) -> tuple[Tensor, ...]:
        *tensors, needs, body = args
        return skin_vjp_jvp(*tensors, needs, body._key)

    @staticmethod
    def backward(ctx: Any, *_: Any) -> Any:
        raise NotImplementedError(THIRD)

    @staticmethod
    def jvp(ctx: Any, *_: Any) -> Any:
        raise NotImplementedError(THIRD)


class CompiledSkin(Function):
    """`Skin` for torch.compile, which takes no Function that defines `jvp`; differentiable once."""

    @staticmethod
    def forward(
        ctx: Any, pose: Tensor, betas: Tensor | None, expression: Tensor | None, transl: Tensor | None, key: int
    ) -> tuple[Tensor, Tensor]:
        ctx.save_for_backward(pose, betas, expression, transl)
        ctx.key = key
        return skin(pose, betas, expression, transl, key)

    @staticmethod
    def backward(ctx: Any, d_vertices: Tensor, d_joints: Tensor) -> tuple[Tensor | None, ...]:
        parameters = ctx.saved_tensors
        needs = sum(1 << bit for bit in range(4) if parameters[bit] is not None)
        return *_asked(skin_vjp(*parameters, d_vertices, d_joints, needs, ctx.key), needs), None


def posed(parameters: Four, body: BodyModel) -> tuple[Tensor, Tensor]:
    """Vertices and joints, differentiable."""
    if torch.compiler.is_compiling():
        return CompiledSkin.apply(*parameters, body._key)
    return Skin.apply(*parameters, body)
