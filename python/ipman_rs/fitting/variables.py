"""The variables of a fit: named blocks with one row per body, and the vector of the free ones for the solver.

orient (B, 3)          the root's rotation vector, in the world
pose (B, P, 3)         rotation vectors of the joints of body and hands, each relative to its parent
face (B, F, 3)         those of jaw and eyes; F is 0 for bodies without them
betas (B, b)           shape
expression (B, E)      of the face, E ≤ 10; E is 0 for bodies without one
transl (B, 3)          m, added to the posed body, in the world
camera_orient (B, 3)   rotation vector of the camera's extrinsics R, world to camera
camera_transl (B, 3)   m, their t: X_c = R X_w + t
log_focal (B, 2)       fx and fy, as logarithms of their ratio to the camera's own
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

import torch
from torch import Tensor

from ipman_rs.body import BodyModel

BLOCKS = (
    "orient", "pose", "face", "betas", "expression", "transl", "camera_orient", "camera_transl", "log_focal"
)  # fmt: skip
FACE = ("jaw", "left_eye_smplhf", "right_eye_smplhf")
COMPONENTS = 10  # betas and expressions at most
Variables = Mapping[str, Tensor]


def pose_joints(body: BodyModel) -> tuple[str, ...]:
    """The joints of the block `pose`, in its order."""
    return tuple(name for name in body.joint_names[1:] if name not in FACE)


def face_joints(body: BodyModel) -> tuple[str, ...]:
    """The joints of the block `face`, in its order."""
    return tuple(name for name in body.joint_names[1:] if name in FACE)


def full_pose(variables: Variables, body: BodyModel) -> Tensor:
    """All joints (B, J, 3) in the body's order, the root first."""
    parts = [variables["orient"][:, None], variables["pose"]]
    if not face_joints(body):
        return torch.cat(parts, dim=1)
    order = (body.joint_names[0], *pose_joints(body), *face_joints(body))
    places = torch.tensor([order.index(name) for name in body.joint_names])
    return torch.cat([*parts, variables["face"]], dim=1).index_select(1, places)


def pose_blocks(pose: Tensor, body: BodyModel) -> dict[str, Tensor]:
    """The blocks orient, pose and face of all joints (B, J, ...)."""
    if not face_joints(body):
        return {"orient": pose[:, 0], "pose": pose[:, 1:], "face": pose[:, :0]}
    rows = {name: row for row, name in enumerate(body.joint_names)}
    return {
        "orient": pose[:, 0],
        "pose": pose[:, [rows[name] for name in pose_joints(body)]],
        "face": pose[:, [rows[name] for name in face_joints(body)]],
    }


def pack(variables: Variables, free: Sequence[str]) -> Tensor:
    """The free blocks as rows (B, P)."""
    return torch.cat([variables[name].flatten(1) for name in free], dim=1)


def unpack(rows: Tensor, free: Sequence[str], rest: Variables) -> dict[str, Tensor]:
    """All blocks: the free ones from their rows (B, P), the others from `rest`."""
    sizes = [math.prod(rest[name].shape[1:]) for name in free]
    parts = zip(free, rows.split(sizes, dim=1), strict=True)
    return {**rest, **{name: part.reshape(len(part), *rest[name].shape[1:]) for name, part in parts}}


def diagonal(weights: Tensor, block: str, variables: Variables, free: Sequence[str]) -> Tensor:
    """The Jacobian (B, P, R) by the free blocks of residuals that are weights (B, R) times the numbers of one block."""
    rows = torch.diag_embed(weights)
    sizes = {name: math.prod(variables[name].shape[1:]) for name in free}
    parts = [rows if name == block else rows.new_zeros(len(rows), size, rows.shape[2]) for name, size in sizes.items()]
    return torch.cat(parts, dim=1)
