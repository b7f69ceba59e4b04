"""The terms against their formulas written out, their masks, labels that are broken, and the whole with its weights."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest
import torch

import ipman_rs.torch as ipt
from ipman_rs import presets
from ipman_rs.training import losses
from ipman_rs.training.lifting import views
from ipman_rs.training.lifting.network import lifting_network
from ipman_rs.training.model import Estimate
from ipman_rs.training.posed_estimate import Posing
from ipman_rs.training.projection import FOCAL, project
from ipman_rs.training.world import to_world


@pytest.fixture(scope="module")
def truth(static):
    return views.views(static, seed=1)


@pytest.fixture(scope="module")
def estimate(truth):
    with torch.no_grad():
        return lifting_network(0)(truth.inputs)


def exact(truth) -> Estimate:
    columns = torch.cat([truth.pose[..., 0], truth.pose[..., 1]], dim=-1)
    return Estimate(columns, truth.betas, torch.tensor([[0.9, 0.0, 0.0]]).expand(len(truth), 3))


def test_projection_is_spins():
    """x = f (X + t_x) / (Z + 2 f / (224 s)), f = 5000 pixels, over half of 224 pixels."""
    points, camera = torch.randn(2, 5, 3), torch.tensor([[0.8, 0.1, -0.2], [1.2, 0.0, 0.3]])
    for body in range(2):
        s, tx, ty = camera[body].tolist()
        for point, found in zip(points[body].tolist(), project(points, camera)[body].tolist(), strict=True):
            depth = point[2] + 2 * 5000 / (224 * s)
            expected = [5000 * (point[0] + tx) / depth / 112, 5000 * (point[1] + ty) / depth / 112]
            np.testing.assert_allclose(found, expected, rtol=1e-4)
    assert pytest.approx(44.642857) == FOCAL


def test_keypoints_2d():
    projected, labels = torch.randn(3, 4, 2), torch.rand(3, 4, 3)
    points = [(b, k) for b in range(3) for k in range(4)]
    expected = np.mean([labels[p][2] * (projected[p][i] - labels[p][i]) ** 2 for p in points for i in (0, 1)])
    assert losses.keypoints_2d_loss(projected, labels).item() == pytest.approx(expected, rel=1e-5)


def test_joints_3d_do_not_see_where_the_body_is():
    joints, labels = torch.randn(4, 24, 3), torch.rand(4, 24, 4) + 0.1
    labels[2, 1, 3] = 0  # a hip without label: that person does not count
    counted = []
    for b in (0, 1, 3):
        error = (joints[b] - joints[b, 1:3].mean(0)) - (labels[b, :, :3] - labels[b, 1:3, :3].mean(0))
        counted.append((labels[b, :, 3:] * error**2).mean().item())
    value = losses.joints_3d_loss(joints, labels)
    assert value.item() == pytest.approx(np.mean(counted), rel=1e-5)
    assert losses.joints_3d_loss(joints + 7.0, labels).item() == pytest.approx(value.item(), rel=1e-4)


def test_body_parameters_of_the_labelled():
    rotations, labels, labelled = torch.randn(3, 24, 3, 3), torch.randn(3, 24, 3, 3), torch.tensor([True, False, True])
    expected = ((rotations - labels)[labelled] ** 2).mean()
    torch.testing.assert_close(losses.pose_loss(rotations, labels, labelled), expected)
    torch.testing.assert_close(
        losses.betas_loss(rotations[:, 0, 0], labels[:, 0, 0], labelled),
        ((rotations - labels)[labelled][:, 0, 0] ** 2).mean(),
    )


def test_nobody_labelled_is_zero_with_a_graph():
    rotations = torch.randn(2, 24, 3, 3, requires_grad=True)
    nobody = torch.zeros(2, dtype=torch.bool)
    total = losses.pose_loss(rotations, torch.zeros(2, 24, 3, 3), nobody)
    total = total + losses.joints_3d_loss(rotations[..., 0], torch.zeros(2, 24, 4))
    total.backward()
    assert total.item() == 0
    assert rotations.grad is not None
    assert (rotations.grad == 0).all()


def test_the_truth_stands(truth, posing):
    """True labels, through the camera and back: bodies on the floor, over their support."""
    posed = posing(exact(truth))
    world = to_world(posed.vertices, posed.hips(truth.regressed), truth)
    assert world[..., 1].amin(dim=1).abs().max() < 2e-6
    margins = ipt.support_margin(world, posing.body.template, ipt.Ground.y_up(), 0.011, "exact")
    assert (margins >= -1e-5).all()


def test_physics_is_the_loss_in_the_world(truth, estimate, posing):
    posed = posing(estimate)
    world = to_world(posed.vertices, posed.hips(truth.regressed), truth)
    expected = ipt.IntuitivePhysicsLoss(posing.body.template, "paper-r")(world, ipt.Ground.y_up())
    total, terms = losses.PhysicsLoss(posing.body.template)(posed, truth)
    for name, value in expected.items():
        assert terms[name].item() == pytest.approx(value.item(), rel=1e-6)
    weights = presets.get("paper-r").weights
    assert total.item() == pytest.approx(sum(weights[name] * terms[name].item() for name in terms), rel=1e-5)


@pytest.mark.parametrize("missing", ["has_body", "standing", "contact", "has_world"])
def test_whose_bodies_count(truth, estimate, posing, missing):
    """The authors' mask needs all four labels; by option the world alone."""
    posed = posing(estimate)
    some = torch.arange(len(truth)) % 3 > 0
    masked = dataclasses.replace(truth, **{missing: some})
    template = posing.body.template
    part = dataclasses.replace(posed, vertices=posed.vertices[some], joints=posed.joints[some])
    alone = losses.PhysicsLoss(template)(part, truth[some])[1]
    everyone = losses.PhysicsLoss(template)(posed, truth)[1]
    for name, value in losses.PhysicsLoss(template)(posed, masked)[1].items():
        assert value.item() == pytest.approx(alone[name].item(), rel=1e-5)
    counted = losses.PhysicsLoss(template, counted="world")(posed, masked)[1]
    expected = alone if missing == "has_world" else everyone
    assert counted["stability"].item() == pytest.approx(expected["stability"].item(), rel=1e-5)


def test_the_weights_of_spin_and_of_the_paper(truth, estimate, posing):
    total, terms = losses.Loss(posing, losses.PhysicsLoss(posing.body.template))(estimate, truth)
    bracket = 5 * terms["keypoints_2d"] + 5 * terms["joints_3d"] + terms["pose"] + 0.001 * terms["betas"]
    bracket = bracket + terms["scale"] + 0.01 * (terms["stability"] + terms["pull"] + terms["push"])
    assert total.item() == pytest.approx(60 * bracket.item(), rel=1e-5)
    assert terms["scale"].item() == pytest.approx(np.exp(-10 * 0.9) ** 2, rel=0.5)


def test_the_gradient_is_that_of_the_loss(static):
    """In double precision, along a random direction of every parameter."""
    posing = Posing(ipt.BodyModel("anny-lite", torch.float64), views.KEYPOINTS)
    truth = views.views(static, seed=1)[:3]
    truth = truth._map(lambda value: value.double() if value.is_floating_point() else value)
    start = exact(truth)
    given = [(value.double() + 0.05 * torch.randn_like(value)).requires_grad_() for value in vars(start).values()]
    loss = losses.Loss(posing, losses.PhysicsLoss(posing.body.template, "balanced"))

    def value(*parameters):
        estimate = Estimate(*parameters)
        posed = posing.body(estimate.pose, estimate.betas)
        from ipman_rs.training.posed_estimate import Posed

        placed = Posed(posed.vertices, posed.joints, posing.points(posed))
        terms = loss._data_terms(estimate, placed, truth)
        assert loss.physics is not None
        return sum(terms.values()) + loss.physics(placed, truth)[0]

    assert torch.autograd.gradcheck(value, given, fast_mode=True)


def test_broken_labels_are_left_out(truth, estimate, posing):
    """A NaN anywhere: the sums are those of the batch whose label is missing, and the gradient is finite."""
    loss = losses.Loss(posing, losses.PhysicsLoss(posing.body.template))
    nan = float("nan")

    def broken(name, index):
        value = getattr(truth, name).clone()
        value[index] = nan
        return dataclasses.replace(truth, **{name: value}).sound()

    def masked(**changes):
        arrays = {name: getattr(truth, name).clone() for name in changes}
        for name, index in changes.items():
            arrays[name][index] = 0
        return dataclasses.replace(truth, **arrays)

    cases = [
        (broken("pose", (3, 5, 1, 2)), masked(has_body=3)),
        (broken("betas", (3, 0)), masked(has_body=3)),
        (broken("keypoints", (2, 4, 0)), masked(keypoints=(2, 4, 2))),
        (broken("joints", (2, 1, 0)), masked(joints=(2, 1, 3))),
        (broken("camera", (1, 0, 0)), masked(has_world=1)),
        (broken("inputs", (1, 0, 0)), masked(has_world=1, has_body=1, keypoints=1, joints=1)),
    ]
    for found, expected in cases:
        leaf = estimate.pose.clone().requires_grad_()
        total, _ = loss(dataclasses.replace(estimate, pose=leaf), found)
        total.backward()
        assert leaf.grad is not None
        assert leaf.grad.isfinite().all()
        assert total.item() == pytest.approx(loss(estimate, expected)[0].item(), rel=1e-6)


def test_unknown_keypoints_are_named():
    with pytest.raises(ValueError, match="no landmark 'left_antenna'"):
        Posing(ipt.BodyModel("anny-lite"), ["nose", "left_antenna"])
