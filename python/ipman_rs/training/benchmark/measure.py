"""The figures of estimated bodies in the world against true ones, an entry a body; metres where nothing is said."""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor

import ipman_rs.torch as ipt
from ipman_rs.evaluation import mpjpe, pa_mpjpe, pve

from ..batch import Batch
from ..model import Estimate
from ..posing import Posed, Posing
from ..world import to_world

Array = NDArray[np.floating]

STRICT = 0.025  # m, of contact
UP = (0.0, 1.0, 0.0)


@dataclass(frozen=True, eq=False)
class Figures:
    """Errors: pelvis on pelvis. bose: the paper's, its centre of mass within the base of support at 10 cm, the pelvis
    where the true one is. strict: the exact centre of mass, 2.5 cm, the body moved onto the floor. lowest: of the
    vertices above the floor. tilt: radians between true and estimated "up", seen from the pelvis."""

    mpjpe: Array
    pa_mpjpe: Array
    pve: Array
    bose: Array
    strict: Array
    lowest: Array
    tilt: Array

    def save(self, path: Path) -> None:
        np.savez_compressed(path, **vars(self))

    @classmethod
    def load(cls, path: Path) -> Figures:
        with np.load(path, allow_pickle=False) as stored:
            return cls(**{field.name: stored[field.name] for field in dataclasses.fields(cls)})


@torch.no_grad()
def figures(estimate: Estimate, truth: Batch, posing: Posing) -> Figures:
    """Of estimates for images whose labels are true, on the floor y = 0."""
    known = Estimate(_columns(truth.pose), truth.betas, estimate.camera)
    vertices, joints = _in_world(posing(estimate), truth)
    true_vertices, true_joints = _in_world(posing(known), truth)
    template, floor = posing.body.template, ipt.Ground.y_up()
    lowest = vertices[..., 1].amin(dim=1)
    snapped = vertices - lowest[:, None, None] * vertices.new_tensor(UP)
    return Figures(
        mpjpe=mpjpe(joints.numpy(), true_joints.numpy()),
        pa_mpjpe=pa_mpjpe(joints.numpy(), true_joints.numpy()),
        pve=pve(vertices.numpy(), true_vertices.numpy(), joints[:, 0].numpy(), true_joints[:, 0].numpy()),
        bose=(ipt.support_margin(vertices, template, floor) >= 0).numpy(),
        strict=(ipt.support_margin(snapped, template, floor, STRICT, "exact") >= 0).numpy(),
        lowest=lowest.numpy(),
        tilt=_tilt(estimate.rotations[:, 0].double(), truth).numpy(),
    )


def _in_world(posed: Posed, truth: Batch) -> tuple[Tensor, Tensor]:
    root = posed.joints[:, 0]
    return to_world(posed.vertices, root, truth).double(), to_world(posed.joints, root, truth).double()


def _columns(rotations: Tensor) -> Tensor:
    return torch.cat([rotations[..., 0], rotations[..., 1]], dim=-1)


def _tilt(root: Tensor, truth: Batch) -> Tensor:
    """The angle between the directions that the two pelvises have for up. Both are (B, 3, 3) in camera axes."""
    up = truth.camera.double() @ root.new_tensor(UP)
    own, true = (torch.einsum("bij,bi->bj", turn, up) for turn in (root, truth.pose[:, 0].double()))
    return torch.atan2(torch.linalg.cross(own, true).norm(dim=1), (own * true).sum(dim=1))
