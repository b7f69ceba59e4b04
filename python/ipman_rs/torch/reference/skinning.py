"""Linear blend skinning in plain torch."""

from __future__ import annotations

from typing import Any, Protocol

import torch
from torch import Tensor, nn


class BodyModel(Protocol):
    """What `ipman_rs.torch.BodyModel` has that skinning reads: the numpy body and its arrays as buffers."""

    body: Any
    v_template: Tensor
    shapedirs: Tensor
    expressiondirs: Tensor
    posedirs: Tensor | None
    J_template: Tensor
    J_shapedirs: Tensor
    J_expressiondirs: Tensor
    parents: tuple[int, ...]
    rest_rotation: Tensor
    weights: Tensor
    pose_mean: Tensor


def posed(
    model: BodyModel, pose: Tensor, betas: Tensor | None, expression: Tensor | None, transl: Tensor | None
) -> tuple[Tensor, Tensor]:
    """Vertices (..., V, 3) and joints (..., J, 3) of checked arguments, from the module's buffers."""
    local = _rotations(model, pose)
    betas = _filled(model, betas, model.body.num_betas)
    expression = _filled(model, expression, model.body.num_expressions)
    if transl is None:
        transl = model.v_template.new_zeros(3)

    rest = model.v_template + _blend(model.shapedirs, betas) + _blend(model.expressiondirs, expression)
    rest_joints = model.J_template + _blend(model.J_shapedirs, betas) + _blend(model.J_expressiondirs, expression)
    if model.posedirs is not None:
        rest = rest + _blend(model.posedirs, (local[..., 1:, :, :] - torch.eye(3).to(local)).flatten(-3))

    # Down the tree: `turned` takes a resting bone to the world.
    world: list[Tensor] = []
    turned: list[Tensor] = []
    joints: list[Tensor] = []
    for j, parent in enumerate(model.parents):
        if parent < 0:
            world.append(local[..., j, :, :])
            joints.append(rest_joints[..., j, :])
        else:
            world.append(world[parent] @ local[..., j, :, :])
            bone = rest_joints[..., j, :] - rest_joints[..., parent, :]
            joints.append(joints[parent] + _apply(turned[parent], bone))
        turned.append(world[j] @ model.rest_rotation[j])

    joint_batch = torch.broadcast_shapes(local.shape[:-3], rest_joints.shape[:-2])
    placed = torch.stack([joint.expand(*joint_batch, 3) for joint in joints], -2)
    rotation = torch.stack(turned, -3)
    offset = placed - _apply(rotation, rest_joints)
    transforms = torch.cat([rotation.flatten(-2).expand(*joint_batch, -1, 9), offset], -1)
    blended = model.weights @ transforms
    vertices = _apply(blended[..., :9].unflatten(-1, (3, 3)), rest) + blended[..., 9:]
    return vertices + transl[..., None, :], placed + transl[..., None, :]


def _rotations(model: BodyModel, pose: Tensor) -> Tensor:
    """Local rotation matrices (..., J, 3, 3) of a pose in either form."""
    import roma  # slow to load: it brings torch's compiler with it

    if pose.shape[-1] == 3:
        return roma.rotvec_to_rotmat(pose + model.pose_mean)
    return roma.special_gramschmidt(pose.unflatten(-1, (2, 3)).transpose(-1, -2))


def _filled(model: BodyModel, value: Tensor | None, size: int) -> Tensor:
    """`value` (..., k) filled up with zeros to (..., size)."""
    if value is None:
        return model.v_template.new_zeros(size)
    return nn.functional.pad(value, (0, size - value.shape[-1]))


def _apply(matrices: Tensor, points: Tensor) -> Tensor:
    return (matrices @ points[..., None])[..., 0]


def _blend(directions: Tensor, amounts: Tensor) -> Tensor:
    """sum_k amounts[..., k] directions[v, :, k] -> (..., V, 3)."""
    return (amounts @ directions.flatten(0, 1).T).unflatten(-1, directions.shape[:2])
