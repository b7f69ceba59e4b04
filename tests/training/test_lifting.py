"""Static people, what cameras see of them, and a regressor that learns."""

from __future__ import annotations

import copy
import math

import numpy as np
import pytest
import torch

import ipman_rs as ip
from ipman_rs.body import load_body
from ipman_rs.synthetic import population
from ipman_rs.synthetic.at_rest import FAMILIES
from ipman_rs.training.lifting import views
from ipman_rs.training.lifting.network import lifting_network
from ipman_rs.training.losses import Loss, PhysicsLoss
from ipman_rs.training.train_loop import TrainingPlan, estimate_all, run_plan


def test_people_stand(static):
    body = load_body(population.BODY)
    vertices = np.asarray(body(static.pose, static.betas, static.transl).vertices)
    np.testing.assert_allclose(vertices[..., 1].min(axis=1), 0, atol=1e-12)
    assert (ip.support_margin(vertices, body.template, ip.Ground.y_up(), 0.01, "exact") >= -1e-9).all()
    pelvis = np.asarray(body(static.pose, static.betas, static.transl).joints)[:, 0]
    np.testing.assert_allclose(pelvis[:, [0, 2]], 0, atol=1e-12)
    assert set(static.family) == set(FAMILIES)


def test_people_depend_on_seed_and_number_alone(static):
    again = population.draw_population(9, seed=7)
    assert np.array_equal(again.pose, static.pose[:9])
    assert not np.array_equal(population.draw_population(1, seed=8).pose, static.pose[:1])


def test_people_survive_their_file(static, tmp_path):
    static.save(tmp_path / "people.npz")
    loaded = population.Population.load(tmp_path / "people.npz")
    assert all(np.array_equal(value, getattr(loaded, name)) for name, value in vars(static).items())


def test_a_mirrored_pose_is_a_mirror_image(static):
    """Joints of the mirrored pose are the mirrored joints of the other side, as far as the mean body is symmetric."""
    body = load_body(population.BODY)
    own, other = (np.asarray(body(pose).joints) for pose in (static.pose, population.mirror(static.pose)))
    swap = [body.joint_names.index(population._other_side(name)) for name in body.joint_names]
    np.testing.assert_allclose(other[:, swap] * [-1, 1, 1], own, atol=6e-3)


def test_cameras_look_at_the_pelvis_from_above(static):
    truth = views.views(static, seed=1, per_body=20)
    camera = truth.camera.double()
    torch.testing.assert_close(camera @ camera.transpose(1, 2), torch.eye(3).double().expand_as(camera))
    assert (torch.linalg.det(camera) > 0).all()
    forward, right = camera[:, 2], camera[:, 0]
    pitch = torch.rad2deg(torch.asin(-forward[:, 1]))  # how far it looks down
    assert pitch.min() >= views.PITCH[0] - 1e-3
    assert pitch.max() <= views.PITCH[1] + 1e-3
    assert pitch.mean().item() == pytest.approx(20, abs=3)
    # Of a camera that looks down by p and rolls by r, the right axis is sin r cos p high.
    roll = torch.asin(right[:, 1] / (1 - forward[:, 1] ** 2).sqrt())
    assert torch.rad2deg(roll).std().item() == pytest.approx(views.ROLL, rel=0.15)
    assert truth.keypoints[..., :2].abs().amax().item() == pytest.approx(1 / views.ROOM, rel=1e-5)


def test_keypoints_are_the_projected_body(static, posing):
    """The labelled body in camera axes, put where the camera has it, projects onto the keypoints but for the crop."""
    truth = views.views(static, seed=1)
    _, places = views._cameras(len(static), np.random.default_rng([1, 0]))
    with torch.no_grad():
        posed = posing.body(torch.cat([truth.pose[..., 0], truth.pose[..., 1]], -1), truth.betas)
        points = posing.points(posed) - posed.joints[:, :1] + torch.from_numpy(places).float()[:, None]
    pixels = points[..., :2] / points[..., 2:]
    for seen, told in zip(pixels, truth.keypoints[..., :2], strict=True):
        side = seen.amax(0) - seen.amin(0)
        middle = 0.5 * (seen.amax(0) + seen.amin(0))
        torch.testing.assert_close((seen - middle) / (0.5 * 1.2 * side.max()), told, atol=1e-4, rtol=0)


def test_noise(static):
    truth = views.views(static, seed=1, per_body=40)
    noisy = views.add_noise(truth, torch.Generator().manual_seed(0))
    there = noisy.inputs[..., 2] > 0
    assert 1 - there.float().mean().item() == pytest.approx(views.DROPPED, rel=0.1)
    error = (noisy.inputs - truth.inputs)[..., :2][there]
    assert error.std().item() == pytest.approx(views.NOISE, rel=0.02)
    assert (noisy.inputs[~there] == 0).all()
    assert torch.equal(noisy.keypoints, truth.keypoints)


@pytest.mark.slow
def test_it_learns_and_repeats_itself(static, posing):
    data = views.views(static, seed=1, per_body=4)
    plan = TrainingPlan(60, 1e-3, 32)
    models = [lifting_network(3) for _ in range(3)]
    start = copy.deepcopy(models[0])
    for model, physics in zip(models, (None, None, PhysicsLoss(posing.body.template)), strict=True):
        loss = Loss(posing, physics)
        run_plan(
            model,
            lambda batch, model=model, loss=loss: loss(model(batch.inputs), batch)[0],
            data,
            views.add_noise,
            plan,
            5,
        )
    first, again, physical = (model.state_dict() for model in models)
    assert all(torch.equal(first[name], again[name]) for name in first)
    assert any(not torch.equal(first[name], physical[name]) for name in first)
    errors = []
    for model in (start, models[0]):
        with torch.no_grad():
            errors.append(Loss(posing)(estimate_all(model, data.inputs), data)[1]["joints_3d"].item())
    assert errors[1] < 0.5 * errors[0]
    assert math.isfinite(errors[1])


def test_a_step_whose_gradient_is_infinite_is_left_out(static):
    """As if it had not been: the weights are those of the steps beside it, less its fall of the rate."""
    data = views.views(static, seed=1)
    model = torch.nn.Linear(1, 1, bias=False)
    torch.nn.init.ones_(model.weight)
    steps = iter([1.0, math.inf, 1.0])
    seen = []

    def loss(batch):
        seen.append(model.weight.item())
        return next(steps) * model.weight.sum()

    run_plan(model, loss, data, lambda batch, generator: batch, TrainingPlan(3, 0.1, 4), 0)
    assert seen[1] == pytest.approx(0.9)  # Adam's first step is the rate
    assert seen[2] == seen[1]
    assert model.weight.item() < seen[1]
