"""The cost of self-contact on tensors: against comparing all with all, gradients, and what is refused."""

from __future__ import annotations

import math

import numpy as np
import pytest
import torch

import ipman_rs as ip
import ipman_rs.torch as ipt
from tests.helpers import overlapping

F64 = torch.float64


@pytest.fixture(scope="module")
def balls():
    template, count = overlapping.balls()
    poses = [overlapping.pushed_together(template, count, (-x, 0.05, 0.02)) for x in (1.5, 1.4, 1.22)]
    return template, torch.from_numpy(np.stack(poses))


@pytest.fixture(scope="module")
def arms(lite):
    return torch.from_numpy(overlapping.arms_in_trunk(lite))


def cost(vertices, template, **options):
    push, pull = ipt.self_contact_loss(vertices, template, **options)
    return push + 3 * pull


def with_gradient(vertices, template, **options):
    vertices = vertices.clone().requires_grad_()
    value = cost(vertices, template, **options)
    return value.detach(), torch.autograd.grad(value.sum(), vertices)[0]


@pytest.mark.slow
@pytest.mark.parametrize("options", [{}, {"push_width": 0.1, "pull_weight": 1.0, "near": 0.05, "geodesic": 0.2}])
def test_as_all_faces_against_all_vertices(lite, arms, options):
    found = with_gradient(arms[1:], lite.template, **options)
    with ipt.dispatch._reference_path():
        expected = with_gradient(arms[1:], lite.template, **options)
    for ours, theirs in zip(found, expected, strict=True):
        torch.testing.assert_close(ours, theirs, rtol=1e-9, atol=1e-9 * theirs.abs().max().item())


def test_numpy_has_the_same_bits(lite, arms):
    for ours, theirs in zip(ipt.self_contact_loss(arms, lite.template),
                            ip.self_contact_loss(arms.numpy(), lite.template), strict=True):  # fmt: skip
        assert (ours.numpy() == theirs).all()


@pytest.mark.slow
def test_gradcheck(balls):
    template, vertices = balls
    push, pull = ipt.self_contact_loss(vertices, template, near=0.1, pull_width=0.05)
    assert (push[:2] > 0.1).all()
    assert (pull > 1e-4).all()
    inputs = vertices.clone().requires_grad_()
    assert torch.autograd.gradcheck(lambda v: ipt.self_contact_loss(v, template, near=0.1, pull_width=0.05), inputs)


def test_gradient_of_a_person(lite, arms):
    """Along random directions, by central differences."""
    generator = torch.Generator().manual_seed(3)
    _, gradient = with_gradient(arms, lite.template, near=0.0)
    assert (gradient.flatten(1).norm(dim=1) > 1).all()
    for _ in range(3):
        direction = torch.randn(arms.shape, generator=generator, dtype=F64)
        step = 1e-7
        ahead, behind = (cost(arms + sign * step * direction, lite.template, near=0.0) for sign in (1, -1))
        slope = (gradient * direction).flatten(1).sum(dim=1)
        # The step's square and rounding over the step leave 1e-7 of slopes around 10.
        torch.testing.assert_close((ahead - behind) / (2 * step), slope, rtol=1e-5, atol=1e-5)


def test_moving_the_body_costs_nothing(lite, arms):
    """No net force and no torque."""
    vertices, gradient = arms[-1], with_gradient(arms[-1], lite.template)[1]
    size = gradient.abs().sum()
    assert gradient.sum(dim=0).abs().max() < 1e-12 * size
    assert torch.linalg.cross(vertices, gradient).sum(dim=0).abs().max() < 1e-12 * size


@pytest.mark.parametrize("dtype", [torch.float32, F64])
def test_rows_do_not_know_of_each_other(lite, arms, dtype):
    vertices = arms.to(dtype)
    batch = with_gradient(vertices[[2, 0, 1, 2]], lite.template)
    for place, body in enumerate((2, 0, 1, 2)):
        alone = with_gradient(vertices[body : body + 1], lite.template)
        assert all(torch.equal(together[place], one[0]) for together, one in zip(batch, alone, strict=True))


@pytest.mark.parametrize("forced", [False, True])
def test_a_bad_body_has_no_gradient(balls, forced):
    template, vertices = balls
    broken = vertices.clone()
    broken[1, 3, 1] = math.inf
    good, bad = with_gradient(vertices, template), None
    if forced:
        with ipt.dispatch._reference_path():
            good, bad = with_gradient(vertices, template), with_gradient(broken, template)
    else:
        bad = with_gradient(broken, template)
    assert bad[0][1].isnan()
    assert (bad[1][1] == 0).all()
    for ours, theirs in zip(bad, good, strict=True):
        assert torch.equal(ours[[0, 2]], theirs[[0, 2]])


def test_batch_dimensions_and_precisions(balls):
    template, vertices = balls
    expected = cost(vertices, template)
    assert torch.equal(cost(vertices[:, None], template), expected[:, None])
    assert torch.equal(cost(vertices[0], template), expected[0])
    assert cost(vertices[:0], template).shape == (0,)
    half = cost(vertices.to(torch.bfloat16), template)
    assert half.dtype == torch.bfloat16


def test_torch_func(balls):
    template, vertices = balls
    mapped = torch.func.vmap(torch.func.grad(lambda v: cost(v, template)))(vertices)
    assert torch.equal(mapped, with_gradient(vertices, template)[1])


def test_second_derivatives_are_refused(balls):
    template, vertices = balls
    inputs = vertices.clone().requires_grad_()
    (gradient,) = torch.autograd.grad(cost(inputs, template).sum(), inputs, create_graph=True)
    with pytest.raises(NotImplementedError, match="second derivatives are not implemented"):
        torch.autograd.grad(gradient.square().sum(), inputs)


def test_forward_mode_is_refused(balls):
    template, vertices = balls
    with pytest.raises(RuntimeError, match="forward"), torch.autograd.forward_ad.dual_level():
        cost(torch.autograd.forward_ad.make_dual(vertices, torch.ones_like(vertices)), template)


def test_the_op(balls):
    template, vertices = balls
    args = (vertices, template._key, 0.3, [0.04, 0.005, 0.005, 0.02])
    torch.library.opcheck(torch.ops.ipman_rs.self_contact.default, args, test_utils=("test_schema", "test_faketensor"))
