"""Cameras around static people, and the keypoints they see."""

from __future__ import annotations

import dataclasses

import numpy as np
import torch
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation
from torch import Tensor

import ipman_rs.torch as ipt
from ipman_rs.body import rotations

from ...synthetic.population import BODY, Population
from ..batch import Batch
from ..model.keypoint_encoder import KEYPOINTS
from ..posed_estimate import HIPS, Posing

Array = NDArray[np.floating]
Draw = np.random.Generator

DISTANCE, PITCH, ROLL = (3.0, 6.0), (-20.0, 60.0), 15.0  # m, degrees the camera looks down, degrees
ROOM = 1.2  # side of the crop over the larger extent of the keypoints
NOISE, DROPPED = 0.02, 0.05  # in half sides of the crop (each coordinate), share of keypoints that are not seen


def posing() -> Posing:
    """The embedded body with the keypoints of this regressor."""
    return Posing(ipt.BodyModel(BODY), KEYPOINTS)


def views(bodies: Population, seed: int, per_body: int = 1) -> Batch:
    """`per_body` images of each person, one after the other: inputs (n, K, 3) without noise, true labels."""
    rows = np.repeat(np.arange(len(bodies)), per_body)
    cameras, places = _cameras(len(rows), np.random.default_rng([seed, 0]))
    matrices = rotations.from_axis_angle(np.asarray(bodies.pose, np.float64))[rows]
    body = posing()
    with torch.no_grad():
        posed = body.body.to(torch.float64)(*(torch.from_numpy(part) for part in (bodies.pose, bodies.betas)))
        hips = (posed.joints[:, HIPS].mean(dim=1) + torch.from_numpy(bodies.transl)).numpy()[rows]
        joints = (posed.joints - posed.joints[:, :1]).numpy()[rows]
        points = (body.points(posed) - posed.joints[:, :1]).numpy()[rows]
    seen = points @ cameras.swapaxes(1, 2) + places[:, None]
    matrices[:, 0] = cameras @ matrices[:, 0]
    count, yes = len(rows), torch.ones(len(rows), dtype=torch.bool)
    one = np.ones((count, len(KEYPOINTS), 1))
    keypoints = _single(np.concatenate([_crop(seen[..., :2] / seen[..., 2:]), one], axis=2))
    return Batch(
        inputs=keypoints,
        keypoints=keypoints,
        joints=_single(np.concatenate([joints @ cameras.swapaxes(1, 2), np.ones((count, joints.shape[1], 1))], 2)),
        pose=_single(matrices),
        betas=_single(bodies.betas[rows]),
        has_body=yes,
        camera=_single(cameras),
        flip=~yes,
        turn=torch.zeros(count),
        hips=_single(hips),
        regressed=~yes,
        up=torch.tensor([0.0, 1.0, 0.0]).expand(count, 3),
        height=torch.zeros(count),
        has_world=yes,
        standing=yes,
        contact=yes,
    )


def add_noise(batch: Batch, generator: torch.Generator) -> Batch:
    """The batch with noise on its input keypoints, some of which are lost (all zero)."""
    points = batch.inputs[..., :2] + NOISE * torch.randn(batch.inputs[..., :2].shape, generator=generator)
    there = (torch.rand(batch.inputs.shape[:2], generator=generator) >= DROPPED).to(points.dtype)[..., None]
    return dataclasses.replace(batch, inputs=torch.cat([points * there, there], dim=-1))


def _cameras(count: int, draw: Draw) -> tuple[Array, Array]:
    """R (n, 3, 3), world to camera, of cameras that look at the pelvis from anywhere around, and the pelvis' place
    (n, 3) in their axes."""
    heading = draw.uniform(0, 360, count)
    pitch, roll = draw.uniform(*PITCH, count), ROLL * draw.standard_normal(count)
    level = np.diag([1.0, -1.0, -1.0])  # looks along −z of the world, its y up in the image
    angles = np.stack([roll, pitch, heading], axis=1)
    # The last turn is about the world's vertical; looking down turns what is seen about the camera's x.
    turns = Rotation.from_euler("ZXY", angles, degrees=True).as_matrix()
    depth = draw.uniform(*DISTANCE, count)
    return level @ turns, np.stack([0 * depth, 0 * depth, depth], axis=1)


def _crop(points: Array) -> Array:
    """Points (n, K, 2) in half sides of the square around them, from its middle."""
    low, high = points.min(axis=1), points.max(axis=1)
    half = 0.5 * ROOM * (high - low).max(axis=1)
    return (points - 0.5 * (low + high)[:, None]) / half[:, None, None]


def _single(array: Array) -> Tensor:
    return torch.from_numpy(np.ascontiguousarray(array)).float()
