"""Metrics of fitted bodies against the true people, one entry per body; in metres unless stated otherwise."""

from __future__ import annotations

import dataclasses

import numpy as np
import torch
from numpy.typing import NDArray

import ipman_rs.torch as ipt
from ipman_rs.evaluation import body_errors, lowest, pve

from ...fitting.candidate import Candidate
from ...fitting.fit import Fit
from .observations import Observations
from .truth import Truth

Array = NDArray[np.floating]


@dataclasses.dataclass(frozen=True)
class FitMetrics:
    """aligned errors: pelvis on pelvis. lowest: of the vertices above the floor. margins: of the exact centre of mass
    inside the base of support of samples within 10 and 3 cm of the floor. size: of the body in its zero pose over the
    true one."""

    mpjpe: Array
    pa_mpjpe: Array
    pve: Array
    pve_world: Array
    margin_10: Array
    margin_3: Array
    lowest: Array
    size: Array
    converged: Array


def fit_metrics(fit: Fit, observed: Observations, truth: Truth) -> FitMetrics:
    """Where the camera is known, errors are those in the world. Where it is not, aligned errors are in the axes of the
    cameras, and those in the world are after the turn about the vertical and the shift along the floor that fit best,
    heights being those above the floor."""
    candidate = fit.candidate
    with torch.no_grad():
        posed, camera, body = candidate.posed, candidate.camera, fit.problem.body
        surface, joints = posed.vertices.double(), posed.joints.double()
        ground = fit.problem.ground
        assert ground is not None
        margins = [
            ipt.support_margin(surface, body.template, ground, threshold, "exact").numpy() for threshold in (0.10, 0.03)
        ]
        heights = ground.signed_height(surface)
        resting = body(betas=fit.variables["betas"].to(body.dtype)).vertices[..., 1]
    seen = surface.numpy(), joints.numpy(), truth.surface, truth.joints
    if fit.problem.presented is not None:
        turns = camera.rotation.numpy(), observed.camera.rotation.numpy()
        seen = tuple(_turned(points, turns[i // 2]) for i, points in enumerate(seen))
        on_floor = surface.numpy() * [1.0, 0.0, 1.0] + heights.numpy()[..., None] * [0.0, 1.0, 0.0]
        world = along_floor(on_floor, truth.surface)
    else:
        world = surface.numpy()
    return FitMetrics(
        *body_errors(*seen),
        pve(world, truth.surface),
        margins[0],
        margins[1],
        heights.amin(dim=1).numpy(),
        (resting.amax(dim=1) - resting.amin(dim=1)).double().numpy() / truth.height,
        fit.converged.astype(float),
    )


def _turned(points: Array, rotations: Array) -> Array:
    return points @ rotations.swapaxes(-1, -2)


def along_floor(points: Array, target: Array) -> Array:
    """Points (n, V, 3) turned about y and moved along x and z so that they come closest to the target."""
    flat, goal = points[..., [2, 0]], target[..., [2, 0]]  # x follows z when turning about y
    middle, aim = flat.mean(axis=1, keepdims=True), goal.mean(axis=1, keepdims=True)
    p, q = flat - middle, goal - aim
    angle = np.arctan2(
        (p[..., 0] * q[..., 1] - p[..., 1] * q[..., 0]).sum(axis=1), (p * q).sum(axis=(1, 2))
    )  # of the turn from p to q
    cosine, sine = np.cos(angle)[:, None], np.sin(angle)[:, None]
    moved = points.copy()
    moved[..., 2] = cosine * p[..., 0] - sine * p[..., 1] + aim[..., 0]
    moved[..., 0] = sine * p[..., 0] + cosine * p[..., 1] + aim[..., 1]
    return moved


def snap_to_floor(fit: Fit) -> Fit:
    """The bodies moved vertically until their lowest vertices lie on the floor: what a floor alone explains."""
    with torch.no_grad():
        candidate = Candidate(fit.problem, fit.variables)
        assert fit.problem.ground is not None
        height = lowest(candidate.vertices.double(), fit.problem.ground)
    transl = fit.variables["transl"] - height[:, None] * torch.tensor([0.0, 1.0, 0.0], dtype=torch.float64)
    return dataclasses.replace(fit, variables={**fit.variables, "transl": transl})


__all__ = ["FitMetrics", "along_floor", "fit_metrics", "snap_to_floor"]
