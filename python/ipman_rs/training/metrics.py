"""Metrics of estimated bodies in the world against true ones, one entry per body; in metres unless stated otherwise.

NaN without ground truth: errors and tilt need labelled parameters, ground metrics need the world.
"""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass
from pathlib import Path
from typing import BinaryIO

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor

from ipman_rs.evaluation import body_errors, bose, lowest, root_tilt

from .batch import Batch
from .model import Estimate
from .posed_estimate import Posed, Posing
from .world import to_world

Array = NDArray[np.floating]


@dataclass(frozen=True, eq=False)
class PoseMetrics:
    """Errors: pelvis on pelvis. bose: the paper's, its centre of mass within the base of support at 10 cm, the hips
    where the true ones are. strict: the strict BoSE (`evaluation.bose`), but of the exact centre of mass. lowest: of
    the vertices above the floor. tilt: radians between true and estimated "up", seen from the pelvis."""

    mpjpe: Array
    pa_mpjpe: Array
    pve: Array
    bose: Array
    strict: Array
    lowest: Array
    tilt: Array

    def save(self, file: BinaryIO) -> None:
        np.savez_compressed(file, **vars(self))

    @classmethod
    def load(cls, path: Path) -> PoseMetrics:
        with np.load(path, allow_pickle=False) as stored:
            return cls(**{field.name: stored[field.name] for field in dataclasses.fields(cls)})


@torch.no_grad()
def pose_metrics(estimate: Estimate, truth: Batch, posing: Posing) -> PoseMetrics:
    """Metrics of estimates for inputs that were not augmented and have true labels."""
    estimate, truth = _on_cpu(estimate), truth.to("cpu")
    posing = posing.to("cpu")
    known = Estimate(_columns(truth.pose), truth.betas, estimate.camera)
    vertices, joints = _in_world(posing(estimate), truth)
    true_vertices, true_joints = _in_world(posing(known), truth)
    template, ground = posing.body.template, truth.ground
    balanced = bose(vertices, template, ground)
    strict = bose(vertices, template, ground, bose_mode="strict", method="exact")
    errors = body_errors(vertices, joints, true_vertices, true_joints)
    body, world = truth.has_body.numpy(), truth.has_world.numpy()
    return PoseMetrics(
        mpjpe=np.where(body, errors.mpjpe.numpy(), np.nan),
        pa_mpjpe=np.where(body, errors.pa_mpjpe.numpy(), np.nan),
        pve=np.where(body, errors.pve.numpy(), np.nan),
        bose=np.where(world, balanced.numpy(), np.nan),
        strict=np.where(world, strict.numpy(), np.nan),
        lowest=np.where(world, lowest(vertices, ground).numpy(), np.nan),
        tilt=np.where(body & world, _tilt(estimate.rotations[:, 0].double(), truth), np.nan),
    )


def _on_cpu(estimate: Estimate) -> Estimate:
    return Estimate(*(value.float().cpu() for value in (estimate.pose, estimate.betas, estimate.camera)))


def _in_world(posed: Posed, truth: Batch) -> tuple[Tensor, Tensor]:
    hips = posed.hips(truth.regressed)
    return to_world(posed.vertices, hips, truth).double(), to_world(posed.joints, hips, truth).double()


def _columns(rotations: Tensor) -> Tensor:
    return torch.cat([rotations[..., 0], rotations[..., 1]], dim=-1)


def _tilt(root: Tensor, truth: Batch) -> Array:
    """Radians (B,) between true and estimated up, as seen by pelvises that turn (B, 3, 3) in camera axes."""
    to_world = truth.camera.double().transpose(1, 2)
    estimated, true = ((to_world @ turn).numpy() for turn in (root, truth.pose[:, 0].double()))
    return np.asarray(root_tilt(estimated, true, truth.ground))


COLUMNS = {
    "MPJPE": 1, "PA-MPJPE": 1, "PVE": 1, "BoSE": 1, "strict BoSE (exact CoM)": 1, "tilt": 2, "penetration": 1,
    "hover": 1,
}  # fmt: skip


def columns(figures: PoseMetrics) -> dict[str, Array]:
    """The metrics in the units of the tables, one entry per body: millimetres, degrees, and shares as 0 or 100 %."""
    return {
        "MPJPE": 1e3 * figures.mpjpe,
        "PA-MPJPE": 1e3 * figures.pa_mpjpe,
        "PVE": 1e3 * figures.pve,
        "BoSE": 100.0 * figures.bose,
        "strict BoSE (exact CoM)": 100.0 * figures.strict,
        "tilt": np.degrees(figures.tilt),
        "penetration": 1e3 * (-figures.lowest).clip(min=0),
        "hover": 1e3 * figures.lowest.clip(min=0),
    }
