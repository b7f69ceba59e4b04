"""From the public functions to the path that computes: batch dimensions, dtypes, devices, compiled code.

CPU tensors go to the compiled core, all others to the tuned `device` path where it covers the quantity, else to the
plain-torch reference.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from contextlib import AbstractContextManager, contextmanager
from typing import TYPE_CHECKING, Literal, NamedTuple

import torch
from torch import Tensor

from ipman_rs import Ground as NumpyGround
from ipman_rs.checks import body_template

from . import device, ops, reference
from .arrays import dense, single_or_double
from .autograd import CompiledValue, CompiledWeighted, Value
from .ground import Ground, as_ground

if TYPE_CHECKING:
    from ipman_rs import BodyTemplate
    from ipman_rs.quantities import Quantity

_forced: Literal["reference", "device"] | None = None


@contextmanager
def _forced_to(path: Literal["reference", "device"]) -> Iterator[None]:
    global _forced
    before, _forced = _forced, path
    try:
        yield
    finally:
        _forced = before


def _reference_path() -> AbstractContextManager[None]:
    """Send all tensors along the plain-torch formulas: for tests and comparisons."""
    return _forced_to("reference")


def _device_path() -> AbstractContextManager[None]:
    """Send CPU tensors along the path of other devices: for tests and comparisons."""
    return _forced_to("device")


def forced() -> bool:
    """Whether CPU tensors are sent along another path now."""
    return _forced is not None


class Bodies(NamedTuple):
    """Arguments in the shape of the ops: vertices (B, V, 3) in the computing dtype, normal (B, 3), height (B,)."""

    vertices: Tensor
    normal: Tensor
    height: Tensor
    batch_shape: torch.Size


_ANY_GROUND = Ground((0.0, 1.0, 0.0), 0.0)


def check(vertices: Tensor, template: BodyTemplate, ground: Ground | NumpyGround | None) -> tuple[torch.Size, Ground]:
    """The batch shape and the ground of arguments that fit together.

    Raises:
        TypeError: vertices is no ordinary floating-point tensor, or the template is none.
        ValueError: vertices does not fit the template, the ground does not broadcast against it, or it requires grad.
    """
    body_template(template)
    shape = dense("vertices", vertices, meta=forced()).shape
    if len(shape) < 2 or shape[-1] != 3 or shape[-2] != template.num_vertices:
        raise ValueError(
            f"vertices: expected shape (..., {template.num_vertices}, 3) for this template, got {tuple(shape)}"
        )
    plane = _ANY_GROUND if ground is None else as_ground(ground)
    if plane.normal.requires_grad or plane.height.requires_grad:
        raise ValueError("ground: a ground that requires grad is not differentiable here; detach its tensors")
    batch_shape = shape[:-2]
    if not (_broadcasts(plane.normal.shape[:-1], batch_shape) and _broadcasts(plane.height.shape, batch_shape)):
        raise ValueError(
            f"ground: normal {tuple(plane.normal.shape)} and height {tuple(plane.height.shape)} do not broadcast to "
            f"the batch {tuple(batch_shape)}; give one plane, or one a body"
        )
    return batch_shape, plane


def _broadcasts(shape: torch.Size, batch_shape: torch.Size) -> bool:
    """Whether it broadcasts to the batch without making it larger."""
    if not shape:
        return True
    sizes = zip(reversed(shape), reversed(batch_shape), strict=False)
    return len(shape) <= len(batch_shape) and all(size in (1, wanted) for size, wanted in sizes)


def bodies(vertices: Tensor, template: BodyTemplate, ground: Ground | NumpyGround | None) -> Bodies:
    """Check the arguments and fold the batch dimensions into one; raises as `check`."""
    batch_shape, plane = check(vertices, template, ground)
    vertices = single_or_double(vertices)
    if vertices.ndim != 3:
        vertices = vertices.reshape(math.prod(batch_shape), *vertices.shape[-2:])
    normal, height = plane.normal.expand(*batch_shape, 3), plane.height.expand(batch_shape)
    if len(batch_shape) != 1:
        normal, height = normal.reshape(len(vertices), 3), height.reshape(len(vertices))
    return Bodies(vertices, normal, height, batch_shape)


def evaluate(
    vertices: Tensor, template: BodyTemplate, ground: Ground | NumpyGround | None, quantity: Quantity
) -> Tensor:
    """`quantity` of vertices (..., V, 3): (..., *quantity.shape) in their dtype, differentiable in vertices.

    Raises as `check`.
    """
    batch = bodies(vertices, template, ground)
    values = values_of(batch, template, quantity).reshape((*batch.batch_shape, *quantity.shape))
    return values if values.dtype == vertices.dtype else values.to(vertices.dtype)


def values_of(batch: Bodies, template: BodyTemplate, quantity: Quantity) -> Tensor:
    """`quantity` of a checked batch: (B, K)."""
    vertices = batch.vertices
    if _on_device(quantity, vertices):
        return device.values(template, quantity, vertices, batch.normal, batch.height)
    if _on_reference(vertices):
        return reference.evaluate(template, quantity, vertices, batch.normal.to(vertices), batch.height.to(vertices))
    normal, height = _for_core(batch)
    if torch.compiler.is_compiling():
        return CompiledValue.apply(vertices, normal, height, *ops.arguments(template, quantity))
    return Value.apply(vertices, normal, height, template, quantity)


def weighted_values_of(
    batch: Bodies, template: BodyTemplate, quantity: Quantity, weights: Tensor
) -> tuple[Tensor, Tensor]:
    """Σ_k weights (B, K) · values (B,), differentiable, and the values (B, K), detached.

    On devices and in compiled code a gradient that will be asked for is computed in the same pass; eager code on the
    CPU has `fused_loss.py` for that.
    """
    vertices = batch.vertices
    wants_gradient = vertices.requires_grad and torch.is_grad_enabled()
    if wants_gradient and _on_device(quantity, vertices):
        return device.weighted(template, quantity, vertices, batch.normal, batch.height, weights)
    if wants_gradient and torch.compiler.is_compiling() and not _on_reference(vertices):
        return CompiledWeighted.apply(vertices, *_for_core(batch), weights, *ops.arguments(template, quantity))
    values = values_of(batch, template, quantity)
    return (values * weights).sum(dim=-1), values.detach()


def _on_reference(vertices: Tensor) -> bool:
    return _forced is not None or vertices.device.type != "cpu"


def _on_device(quantity: Quantity, vertices: Tensor) -> bool:
    return _on_reference(vertices) and _forced != "reference" and device.covers(quantity, vertices)


def _for_core(batch: Bodies) -> tuple[Tensor, Tensor]:
    """normal and height as the core takes them, wherever they came from."""
    return batch.normal.to("cpu", torch.float64), batch.height.to("cpu", torch.float64)
