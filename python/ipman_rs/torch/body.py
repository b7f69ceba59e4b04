"""`ipman_rs.body.BodyModel` on tensors: the same shape, pose and skinning, differentiable in every parameter."""

from __future__ import annotations

import functools
import math
import os
from collections.abc import Sequence
from dataclasses import dataclass

import torch
from torch import Tensor, nn

from ipman_rs import BodyTemplate
from ipman_rs import body as numpy_body

from . import dispatch, reference, skinning
from .arrays import dense


@dataclass(frozen=True)
class BodyOutput:
    """`vertices` (..., V, 3) and `joints` (..., J, 3) of posed bodies, in metres."""

    vertices: Tensor
    joints: Tensor


class BodyModel(nn.Module):
    """A body model as a module without parameters; its arrays are buffers that `.to(...)` moves.

    `body` is a numpy `BodyModel`, the name of an embedded body, or the path of a model file (options such as
    `flat_hand_mean` belong to `ipman_rs.load_body`). `dtype` is that of the buffers, torch's default dtype if None.
    """

    v_template: Tensor
    shapedirs: Tensor
    expressiondirs: Tensor
    posedirs: Tensor | None
    J_template: Tensor
    J_shapedirs: Tensor
    J_expressiondirs: Tensor
    rest_rotation: Tensor
    weights: Tensor
    pose_mean: Tensor
    faces: Tensor

    def __init__(self, body: numpy_body.BodyModel | str | os.PathLike[str], dtype: torch.dtype | None = None):
        super().__init__()
        self.body = body if isinstance(body, numpy_body.BodyModel) else numpy_body.load_body(body)
        self.parents: tuple[int, ...] = tuple(self.body.parents.tolist())  # torch.compile reads no arrays
        dtype = dtype or torch.get_default_dtype()
        for name in BodyModel.__annotations__:
            array = getattr(self.body, name)
            buffer = None if array is None else torch.tensor(array, dtype=torch.int64 if name == "faces" else dtype)
            self.register_buffer(name, buffer, persistent=False)

    @property
    def template(self) -> BodyTemplate:
        """The template of the numpy body: what `ipman_rs.torch`'s quantities and losses take."""
        return self.body.template

    def forward(
        self,
        pose: Tensor | None = None,
        betas: Tensor | None = None,
        transl: Tensor | None = None,
        expression: Tensor | None = None,
    ) -> BodyOutput:
        """Posed bodies; arguments, shapes, broadcasting and errors as in `ipman_rs.body.BodyModel.forward`."""
        for name, value in (("pose", pose), ("betas", betas), ("transl", transl), ("expression", expression)):
            if value is not None:
                dense(name, value, whole=True)
        given = [self._pose(pose), self._components("betas", betas, self.body.num_betas)]
        given += [self._components("expression", expression, self.body.num_expressions)]
        given += [self._components("transl", transl, 3, exact=True)]
        batch = _common_batch(given)
        if not self._on_core(given):
            vertices, joints = reference.skinning.posed(self, *given)
            return BodyOutput(vertices.expand(*batch, -1, -1), joints.expand(*batch, -1, -1))
        dtype = functools.reduce(torch.promote_types, (value.dtype for value in given if value is not None), self.dtype)
        rows = [_rows(value, batch, tail, dtype) for value, tail in zip(given, _TAILS, strict=True)]
        vertices, joints = skinning.posed(rows, self.body)
        if len(batch) != 1:
            vertices, joints = vertices.reshape(*batch, *vertices.shape[1:]), joints.reshape(*batch, *joints.shape[1:])
        return BodyOutput(vertices, joints)

    @property
    def dtype(self) -> torch.dtype:
        """Of the buffers."""
        return self.v_template.dtype

    def _on_core(self, given: Sequence[Tensor | None]) -> bool:
        """Whether the compiled core computes: on CPU, in one of its two precisions."""
        if dispatch._forced or self.dtype not in (torch.float32, torch.float64):
            return False
        return all(value is None or value.device.type == "cpu" for value in (self.v_template, *given))

    def _pose(self, pose: Tensor | None) -> Tensor:
        """The pose in either form, (..., J, 3) or (..., J, 6). ValueError if it is neither."""
        count = self.body.num_joints
        if pose is None:
            return torch.zeros_like(self.pose_mean)
        if pose.shape[-2:] in ((count, 3), (count, 6)):
            return pose
        raise ValueError(
            f"pose: expected (..., {count}, 3) axis-angle or (..., {count}, 6) 6D for the body {self.body.name!r}, got "
            f"shape {tuple(pose.shape)}; reshape a flat pose with pose.reshape(..., {count}, 3)"
        )

    def _components(self, name: str, value: Tensor | None, size: int, exact: bool = False) -> Tensor | None:
        """`value` (..., k), k up to size. ValueError unless k fits."""
        if value is None or (value.ndim > 0 and (value.shape[-1] == size or (value.shape[-1] < size and not exact))):
            return value
        expected = f"(..., {'' if exact else 'up to '}{size})"
        raise ValueError(f"{name}: expected shape {expected}, got {tuple(value.shape)}")


_NAMES = ("pose", "betas", "expression", "transl")
_TAILS = (2, 1, 1, 1)  # dimensions of one body's share


def _common_batch(given: Sequence[Tensor | None]) -> tuple[int, ...]:
    shapes = [None if value is None else value.shape[:-tail] for value, tail in zip(given, _TAILS, strict=True)]
    first = shapes[0]
    if all(shape is None or shape == first for shape in shapes):
        return tuple(first or ())
    try:
        return tuple(torch.broadcast_shapes(*(shape for shape in shapes if shape is not None)))
    except RuntimeError:
        named = zip(_NAMES, shapes, strict=True)
        listed = ", ".join(f"{name} {tuple(shape)}" for name, shape in named if shape is not None)
        raise ValueError(f"batch dimensions do not fit together: {listed}") from None


def _rows(value: Tensor | None, batch: tuple[int, ...], tail: int, dtype: torch.dtype) -> Tensor | None:
    """`value` with one batch dimension, a view where all bodies share it."""
    if value is None:
        return None
    if value.dtype != dtype:
        value = value.to(dtype)
    if len(batch) == 1 and value.ndim == tail + 1 and value.shape[0] == batch[0]:
        return value
    shape = value.shape[-tail:]
    return value.expand(*batch, *shape).reshape(math.prod(batch), *shape)
