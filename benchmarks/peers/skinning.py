"""Linear blend skinning: pose (B, 24, 3) axis-angle, betas (B, 10) and translation (B, 3) -> vertices (B, V, 3).

Three ways over one synthetic file with SMPL's counts: the smplx package, the same procedure written afresh and
vectorised, and `ipman_rs.torch.BodyModel`.
"""

from __future__ import annotations

import pickle
from pathlib import Path
from typing import Any

import numpy as np
import torch
from torch import Tensor

import ipman_rs as ip
import ipman_rs.torch as ipt

from ..bodies import CACHE, body

POSE_FEATURES = 9 * 23


def synthetic_smpl() -> Path:
    """A file as SMPL is shipped, with the decimated body in it and random pose blend shapes of their usual size."""
    path = CACHE / "SMPL_NEUTRAL.pkl"
    if not path.exists():
        model = body("smpl")
        rng = np.random.default_rng(0)
        zero = model().vertices
        distance = np.linalg.norm(zero[None] - model().joints[:, None], axis=-1)
        regressor = np.zeros(distance.shape)
        np.put_along_axis(regressor, distance.argsort(axis=1)[:, :20], 1 / 20, axis=1)
        arrays = {
            "v_template": zero,
            "shapedirs": model.shapedirs,
            "posedirs": 1e-3 * rng.normal(size=(model.num_vertices, 3, POSE_FEATURES)),
            "J_regressor": regressor,
            "weights": model.weights,
            "f": model.faces.astype(np.uint32),
            "kintree_table": np.stack([model.parents, np.arange(model.num_joints)]).astype(np.uint32),
        }
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_bytes(pickle.dumps(arrays, protocol=2))
    return path


class Smplx:
    """The smplx package."""

    def __init__(self) -> None:
        import smplx

        self.model: Any = smplx.SMPL(str(synthetic_smpl()))

    def __call__(self, pose: Tensor, betas: Tensor, transl: Tensor) -> Tensor:
        return self.model(
            global_orient=pose[:, :1].flatten(1), body_pose=pose[:, 1:].flatten(1), betas=betas, transl=transl
        ).vertices


class TorchSkinning:
    """Shape blend, pose blend, Rodrigues, the kinematic chain by 4 × 4 products, blended transforms."""

    def __init__(self, dtype: torch.dtype = torch.float32) -> None:
        model = ip.load_body(synthetic_smpl())

        def floats(array: Any) -> Tensor:
            return torch.tensor(np.asarray(array), dtype=dtype)

        self.parents = model.parents.tolist()
        self.v_template, self.shapedirs = floats(model.v_template), floats(model.shapedirs)
        assert model.posedirs is not None
        self.posedirs = floats(model.posedirs).flatten(0, 1).T.contiguous()
        self.joints, self.joint_shapes = floats(model.J_template), floats(model.J_shapedirs)
        self.weights = floats(model.weights)

    def __call__(self, pose: Tensor, betas: Tensor, transl: Tensor) -> Tensor:
        batch = len(pose)
        shaped = self.v_template + torch.einsum("bl,vkl->bvk", betas, self.shapedirs)
        joints = self.joints + torch.einsum("bl,jkl->bjk", betas, self.joint_shapes)
        rotations = rodrigues(pose.reshape(-1, 3)).reshape(batch, -1, 3, 3)
        feature = (rotations[:, 1:] - torch.eye(3).to(pose)).flatten(1)
        rest = shaped + (feature @ self.posedirs).reshape(batch, -1, 3)

        bones = joints.clone()
        bones[:, 1:] = joints[:, 1:] - joints[:, self.parents[1:]]
        local = torch.cat([torch.cat([rotations, bones[..., None]], dim=-1), self._last_row(rotations)], dim=-2)
        chain = [local[:, 0]]
        for joint, parent in enumerate(self.parents[1:], start=1):
            chain.append(chain[parent] @ local[:, joint])
        world = torch.stack(chain, dim=1)
        offset = (world[..., :3, :3] @ joints[..., None])[..., 0]
        rows = torch.cat([world[..., :3, :3], (world[..., :3, 3] - offset)[..., None]], dim=-1)
        blended = (self.weights @ rows.flatten(-2)).unflatten(-1, (3, 4))
        vertices = (blended[..., :3] @ rest[..., None])[..., 0] + blended[..., 3]
        return vertices + transl[:, None]

    @staticmethod
    def _last_row(rotations: Tensor) -> Tensor:
        return rotations.new_tensor([0.0, 0.0, 0.0, 1.0]).expand(*rotations.shape[:2], 1, 4)


class OurSkinning:
    def __init__(self) -> None:
        self.model = ipt.BodyModel(ip.load_body(synthetic_smpl()), dtype=torch.float32)

    def __call__(self, pose: Tensor, betas: Tensor, transl: Tensor) -> Tensor:
        return self.model(pose, betas, transl).vertices


def rodrigues(vectors: Tensor) -> Tensor:
    """Rotation matrices (N, 3, 3) of axis-angle vectors (N, 3)."""
    angle = torch.norm(vectors + 1e-8, dim=1, keepdim=True)
    x, y, z = (vectors / angle).unbind(dim=1)
    zero = torch.zeros_like(x)
    skew = torch.stack([zero, -z, y, z, zero, -x, -y, x, zero], dim=1).reshape(-1, 3, 3)
    sin, cos = angle.sin()[..., None], angle.cos()[..., None]
    return torch.eye(3).to(vectors) + sin * skew + (1 - cos) * (skew @ skew)


def parameters(batch: int, dtype: torch.dtype = torch.float32) -> tuple[Tensor, Tensor, Tensor]:
    """Random pose, betas and translation that ask for gradients."""
    generator = torch.Generator().manual_seed(0)
    shapes = ((batch, 24, 3), (batch, 10), (batch, 3))
    pose, betas, transl = (torch.randn(shape, generator=generator, dtype=torch.float64) for shape in shapes)
    pose, betas, transl = (value.to(dtype).requires_grad_() for value in (0.3 * pose, betas, transl))
    return pose, betas, transl
