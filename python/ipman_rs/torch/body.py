"""`ipman_rs.body.BodyModel` on tensors: the same shape, pose and skinning, differentiable in every parameter."""

from __future__ import annotations

import os
from dataclasses import dataclass

import roma
import torch
from torch import Tensor, nn

from ipman_rs import BodyTemplate
from ipman_rs import body as numpy_body


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
        local = self._rotations(pose)
        betas = self._components("betas", betas, self.body.num_betas)
        expression = self._components("expression", expression, self.body.num_expressions)
        if transl is None:
            transl = self.v_template.new_zeros(3)
        elif transl.shape[-1:] != (3,):
            raise ValueError(f"transl: expected shape (..., 3), got {tuple(transl.shape)}")

        rest = self.v_template + _blend(self.shapedirs, betas) + _blend(self.expressiondirs, expression)
        rest_joints = self.J_template + _blend(self.J_shapedirs, betas) + _blend(self.J_expressiondirs, expression)
        if self.posedirs is not None:
            rest = rest + _blend(self.posedirs, (local[..., 1:, :, :] - torch.eye(3).to(local)).flatten(-3))

        # Down the tree: `turned` takes a resting bone to the world.
        world: list[Tensor] = []
        turned: list[Tensor] = []
        joints: list[Tensor] = []
        for j, parent in enumerate(self.body.parents.tolist()):
            if parent < 0:
                world.append(local[..., j, :, :])
                joints.append(rest_joints[..., j, :])
            else:
                world.append(world[parent] @ local[..., j, :, :])
                bone = rest_joints[..., j, :] - rest_joints[..., parent, :]
                joints.append(joints[parent] + _apply(turned[parent], bone))
            turned.append(world[j] @ self.rest_rotation[j])

        joint_batch = torch.broadcast_shapes(local.shape[:-3], rest_joints.shape[:-2])
        placed = torch.stack([joint.expand(*joint_batch, 3) for joint in joints], -2)
        rotation = torch.stack(turned, -3)
        offset = placed - _apply(rotation, rest_joints)
        transforms = torch.cat([rotation.flatten(-2).expand(*joint_batch, -1, 9), offset], -1)
        blended = self.weights @ transforms
        vertices = _apply(blended[..., :9].unflatten(-1, (3, 3)), rest) + blended[..., 9:]
        return BodyOutput(vertices + transl[..., None, :], placed + transl[..., None, :])

    def _rotations(self, pose: Tensor | None) -> Tensor:
        """Local rotation matrices (..., J, 3, 3) of a pose in either form."""
        count = self.body.num_joints
        if pose is None:
            pose = torch.zeros_like(self.pose_mean)
        if pose.shape[-2:] == (count, 3):
            return roma.rotvec_to_rotmat(pose + self.pose_mean)
        if pose.shape[-2:] == (count, 6):
            return roma.special_gramschmidt(pose.unflatten(-1, (2, 3)).transpose(-1, -2))
        raise ValueError(
            f"pose: expected (..., {count}, 3) axis-angle or (..., {count}, 6) 6D for the body {self.body.name!r}, got "
            f"shape {tuple(pose.shape)}; reshape a flat pose with pose.reshape(..., {count}, 3)"
        )

    def _components(self, name: str, value: Tensor | None, size: int) -> Tensor:
        """`value` (..., k) filled up with zeros to (..., size); None gives zeros. ValueError unless k fits."""
        if value is None:
            return self.v_template.new_zeros(size)
        if value.ndim == 0 or value.shape[-1] > size:
            raise ValueError(f"{name}: expected shape (..., up to {size}), got {tuple(value.shape)}")
        return nn.functional.pad(value, (0, size - value.shape[-1]))


def _apply(matrices: Tensor, points: Tensor) -> Tensor:
    return (matrices @ points[..., None])[..., 0]


def _blend(directions: Tensor, amounts: Tensor) -> Tensor:
    """sum_k amounts[..., k] directions[v, :, k] -> (..., V, 3)."""
    return (amounts @ directions.flatten(0, 1).T).unflatten(-1, directions.shape[:2])
