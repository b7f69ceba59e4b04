"""Where fits start, and the floor that stages find."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
import torch

import ipman_rs.torch as ipt
from ipman_rs.body import poses
from ipman_rs.data.keypoints import mediapipe
from ipman_rs.fitting import config, start
from ipman_rs.fitting.camera import Camera
from ipman_rs.fitting.fit import fit
from ipman_rs.fitting.landmarks import Landmarks, landmark_names
from ipman_rs.fitting.problem import Presented, Problem
from ipman_rs.fitting.rotations import matrix, vector
from tests.helpers import fit_terms_cases as cases

TURNS = {"standing": 10, "kneeling": 100, "sitting": 200, "all_fours": 290, "one_leg": 30, "lying": 70}  # degrees


def double(*numbers) -> torch.Tensor:
    return torch.tensor(numbers, dtype=torch.float64)


def seen_problem(turns=TURNS) -> Problem:
    """People in named poses, turned about the vertical, 4 m before a level camera."""
    body = cases.body_model()
    count = len(turns)
    landmarks = Landmarks(body, tuple(name for name in mediapipe.NAMES if name in landmark_names(body.body)))
    angles = torch.stack([torch.as_tensor(poses.pose_of(body.body, name)) for name in turns]).double()
    yaw = torch.zeros(count, 3, dtype=torch.float64)
    yaw[:, 1] = torch.deg2rad(double(*turns.values()))
    angles[:, 0] = vector(matrix(yaw) @ matrix(angles[:, 0]))
    points = landmarks(angles, torch.zeros(count, 10, dtype=torch.float64), double(0.1, 0.2, -4.0).expand(count, 3))
    camera = Camera(
        double(900, 900).expand(count, 2),
        double(500, 500).expand(count, 2),
        start.level_camera().expand(count, 3, 3),
        torch.zeros(count, 3, dtype=torch.float64),
    )
    pixels = camera.project(points)
    size = double(1000, 1000).expand(count, 2)
    return Problem(body, landmarks, camera, None, pixels, torch.ones_like(pixels[..., 0]), image_size=size)


def test_the_named_pose_that_is_seen_is_found():
    problem = seen_problem()
    found = start.before_camera(problem, yaws=4)
    for row, name in enumerate(TURNS):
        expected = torch.as_tensor(poses.pose_of(problem.body.body, name))[1:].double()
        torch.testing.assert_close(found["pose"][row], expected, rtol=0, atol=1e-12, msg=name)
    # The pose is exact, so what is left is how far 12 iterations come with priors of the shape: centimetres.
    assert (found["transl"] - double(0.1, 0.2, -4.0)).norm(dim=1).max() < 0.1


@pytest.mark.slow
def test_a_start_depends_on_its_own_row_alone():
    problem = seen_problem()
    found = start.before_camera(problem)
    for row in range(problem.num_bodies):
        alone = start.before_camera(problem.rows(torch.tensor([row])))
        for name, value in found.items():
            assert torch.equal(alone[name][0], value[row]), name


def test_a_presented_pose_is_not_replaced():
    problem = seen_problem({"sitting": 0})
    standing = torch.as_tensor(poses.pose_of(problem.body.body, "standing"))[None, 1:].double()
    found = start.before_camera(replace(problem, presented=Presented(standing)))
    assert torch.equal(found["pose"], standing)


def stages(*found: bool) -> config.FitConfig:
    preset = config.load("fast")
    last = preset.stages[-1]
    stage = replace(last, options=replace(last.options, iterations=3))
    return replace(preset, stages=tuple(replace(stage, find_ground=find) for find in found), hypotheses=None)


def lowest(problem: Problem, variables) -> np.ndarray:
    pose = torch.cat([variables["orient"][:, None], variables["pose"]], dim=1)
    body = problem.body.body
    vertices = body(pose.numpy(), variables["betas"].numpy(), variables["transl"].numpy()).vertices
    return np.asarray(vertices)[..., 1].min(axis=1)


@pytest.mark.slow
def test_a_floor_that_was_found_is_found_again():
    problem = seen_problem({"standing": 0, "sitting": 30})
    begun = start.before_camera(problem)
    done = fit(problem, begun, stages(True, False, True))
    once = fit(problem, begun, stages(True, False, False))
    # In the body model's own float32.
    assert once.problem.ground.height.numpy() == pytest.approx(lowest(problem, begun), abs=1e-5)
    before = done.stages[1].variables
    assert done.problem.ground.height.numpy() == pytest.approx(lowest(problem, before), abs=1e-5)
    assert np.abs(lowest(problem, before) - lowest(problem, begun)).max() > 1e-3


def test_a_given_floor_stays():
    problem = seen_problem({"standing": 0})
    problem = replace(problem, ground=ipt.Ground(double([0.0, 1.0, 0.0]), double(-0.8)))
    done = fit(problem, start.before_camera(problem), stages(True, True))
    assert done.problem.ground is problem.ground
