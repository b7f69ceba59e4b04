"""The observations that a fit gets of a person: points in an image, and

calibrated   the camera and the floor in the world; no pose (IPMAN-O*)
regressed    as calibrated, but fits begin where a network's estimate might be, and not at a search over yaws
presented    a pose that the person imitates, true up to noise of some degrees per number, with its floor; height and
             mass; the camera and its focal length are unknown (IPMAN-O)

Points are those that MediaPipe has, moved by 1 % of the person's height in the image (standard deviation of each
coordinate), one in thirty by 5 %, and one in ten not seen.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor

import ipman_rs.torch as ipt
from ipman_rs.body import load_body

from ...data.keypoints import mediapipe
from ...fitting import start
from ...fitting.camera import Camera
from ...fitting.landmarks import Landmarks, landmark_names
from ...fitting.presented import self_touching_vertices
from ...fitting.problem import Presented, Problem
from .truth import FITTED, Truth

Array = NDArray[np.floating]

SIZE = 1000.0  # pixels, width and height of the image
NOISE, OUTLIERS, FAR, DROPPED = 0.01, 1 / 30, 0.05, 0.1
FOCAL = (1.0, 2.0)  # times the image's height; where it is unknown, fits begin at the mean of the logarithm
REGRESSED, DEPTH = 10.0, 0.05  # degrees of each number, and of the logarithm of the distance
DISTANCE, CAMERA_HEIGHT, ROLL = (3.0, 5.0), (0.6, 1.8), 2.0  # m, m, degrees


@dataclass(frozen=True)
class Observations:
    """A problem, where its fits start, and the true camera, in which errors of the presented setting are measured."""

    problem: Problem
    starts: dict[str, Tensor]
    camera: Camera


def calibrated_observations(truth: Truth, seed: int) -> Observations:
    draw = np.random.default_rng([seed, 1])
    camera = cameras(truth, draw)
    problem = _seen(truth, camera, draw)
    return Observations(problem, start.before_camera(problem), camera)


def regressed_observations(truth: Truth, seed: int) -> Observations:
    """Starts: the true pose but for a noise, the mean shape, the pelvis seen where it is but at a wrong distance."""
    draw = np.random.default_rng([seed, 3])
    observed = calibrated_observations(truth, seed)
    pose = torch.from_numpy(truth.pose + math.radians(REGRESSED) * draw.standard_normal(truth.pose.shape))
    away = torch.from_numpy(np.exp(DEPTH * draw.standard_normal(len(truth))))
    camera = observed.camera
    place = -(camera.rotation * camera.translation[:, :, None]).sum(dim=1)
    pelvis = place + away[:, None] * (torch.from_numpy(truth.joints[:, 0]) - place)
    resting = torch.from_numpy(np.asarray(load_body(FITTED)().joints)[0])
    starts = {**start.neutral(observed.problem), "orient": pose[:, 0], "pose": pose[:, 1:], "transl": pelvis - resting}
    return Observations(observed.problem, starts, camera)


def presented_observations(truth: Truth, seed: int, noise: float) -> Observations:
    """noise: degrees."""
    draw = np.random.default_rng([seed, 2])
    camera = cameras(truth, draw)
    guess = np.full((len(truth), 2), SIZE * math.sqrt(FOCAL[0] * FOCAL[1]))
    unknown = Camera(
        torch.from_numpy(guess), camera.center, start.level_camera().expand(len(truth), 3, 3), 0 * camera.translation
    )
    seen = _seen(truth, camera, draw)
    pose = truth.pose + math.radians(noise) * draw.standard_normal(truth.pose.shape)
    problem = Problem(
        seen.body,
        seen.landmarks,
        unknown,
        _under(pose, truth.lowest),
        seen.points,
        seen.confidence,
        image_size=seen.image_size,
        height=torch.from_numpy(truth.height),
        mass=torch.from_numpy(truth.mass),
        presented=Presented(torch.from_numpy(pose[:, 1:]), _touching(pose), torch.from_numpy(pose[:, 0])),
    )
    return Observations(problem, start.camera_around(problem), camera)


def _touching(pose: Array) -> Tensor:
    """Which vertices (n, V) touch another part of the mean body in each presented pose (n, J, 3)."""
    body = load_body(FITTED)
    contact = torch.zeros(len(pose), body.num_vertices, dtype=torch.bool)
    for row, each in enumerate(pose):
        contact[row, torch.from_numpy(self_touching_vertices(body, each))] = True
    return contact


def cameras(truth: Truth, draw: np.random.Generator) -> Camera:
    """One camera per person, at any azimuth, looking at the middle of the body."""
    count = len(truth)
    middle = (truth.surface.max(axis=1) + truth.surface.min(axis=1)) / 2
    heading, distance = draw.uniform(0, 2 * np.pi, count), draw.uniform(*DISTANCE, count)
    place = middle + distance[:, None] * np.stack([np.sin(heading), np.zeros(count), np.cos(heading)], axis=1)
    place[:, 1] = draw.uniform(*CAMERA_HEIGHT, count)
    rotation = _looking(middle - place, np.radians(ROLL) * draw.standard_normal(count))
    focal = SIZE * np.exp(draw.uniform(math.log(FOCAL[0]), math.log(FOCAL[1]), count))
    translation = -(rotation * place[:, None]).sum(axis=2)
    arrays = (np.stack([focal, focal], axis=1), np.full((count, 2), SIZE / 2), rotation, translation)
    return Camera(*map(torch.from_numpy, arrays))


def _looking(towards: Array, roll: Array) -> Array:
    """R (n, 3, 3) of cameras that look along vectors (n, 3), the world's y up in the image but for a roll (n,)."""
    forward = towards / np.linalg.norm(towards, axis=1, keepdims=True)
    right = np.cross(forward, [0.0, 1.0, 0.0])
    right /= np.linalg.norm(right, axis=1, keepdims=True)
    down = np.cross(forward, right)
    cosine, sine = np.cos(roll)[:, None], np.sin(roll)[:, None]
    return np.stack([cosine * right + sine * down, cosine * down - sine * right, forward], axis=1)


def _seen(truth: Truth, camera: Camera, draw: np.random.Generator) -> Problem:
    """The problem with a given camera and the floor y = 0."""
    body = ipt.BodyModel(FITTED)
    there = landmark_names(load_body(FITTED))
    names = tuple(name for name in mediapipe.NAMES if name in there)
    points = camera.project(torch.from_numpy(truth.landmarks[:, [there.index(name) for name in names]])).numpy()
    size = np.ptp(points[..., 1], axis=1).clip(min=np.ptp(points[..., 0], axis=1))
    spread = np.where(draw.uniform(size=points.shape[:2]) < OUTLIERS, FAR, NOISE) * size[:, None]
    points = points + spread[..., None] * draw.standard_normal(points.shape)
    confidence = np.where(draw.uniform(size=points.shape[:2]) < DROPPED, 0.0, 1.0)
    count = len(truth)
    up = torch.tensor([0.0, 1.0, 0.0], dtype=torch.float64).expand(count, 3)
    return Problem(
        body,
        Landmarks(body, names),
        camera,
        ipt.Ground(up, torch.zeros(count, dtype=torch.float64)),
        torch.from_numpy(points),
        torch.from_numpy(confidence),
        image_size=torch.full((count, 2), SIZE, dtype=torch.float64),
    )


def _under(pose: Array, above: Array) -> ipt.Ground:
    """The floor under the mean body in each pose (n, 24, 3), which is so high above it (n,)."""
    level = np.asarray(load_body(FITTED)(pose).vertices)[..., 1].min(axis=1) - above
    return ipt.Ground(torch.tensor([0.0, 1.0, 0.0], dtype=torch.float64).expand(len(pose), 3), torch.from_numpy(level))


__all__ = ["Observations", "calibrated_observations", "presented_observations", "regressed_observations"]
