"""The plane on tensors does what the plane on arrays does, and refuses to pretend that it has a gradient."""

from __future__ import annotations

import pickle

import numpy as np
import pytest
import torch

import ipman_rs as ip
import ipman_rs.torch as ipt


@pytest.mark.parametrize("normal", [(0, 2.0, 0), (0.3, 0.5, -0.2), (0, 0, -1), (1, 0.01, 0)])
def test_as_numpy(normal):
    ours, theirs = ipt.Ground(normal, 0.3), ip.Ground(normal, 0.3)
    points = np.random.default_rng(0).normal(size=(7, 3))
    np.testing.assert_allclose(ours.normal, theirs.normal, rtol=1e-15)
    np.testing.assert_allclose(ours.signed_height(torch.from_numpy(points)), theirs.signed_height(points), atol=1e-15)
    np.testing.assert_allclose(ours.project(torch.from_numpy(points)), theirs.project(points), atol=1e-15)
    for our, their in zip(ours.axes(), theirs.axes(), strict=True):
        np.testing.assert_allclose(our, their, atol=1e-15)
    assert ours.signed_height(torch.from_numpy(points[0])).shape == ()


def test_one_a_body():
    normals = torch.tensor([[0.0, 1, 0], [0.0, 0, 1]])
    ground = ipt.Ground(normals, torch.tensor([0.0, 1.0]))
    points = torch.randn(2, 5, 3, dtype=torch.float64)
    expected = torch.stack([points[0, :, 1], points[1, :, 2] - 1])
    torch.testing.assert_close(ground.signed_height(points), expected)
    assert ground.project(points).shape == points.shape


def test_constructors():
    assert ipt.Ground.y_up(0.5).normal.tolist() == [0, 1, 0]
    assert ipt.Ground.z_up().normal.tolist() == [0, 0, 1]
    assert ipt.Ground.y_up(0.5).height.item() == 0.5
    assert pickle.loads(pickle.dumps(ipt.Ground.y_up(0.5))).height.item() == 0.5


def test_any_dtype(tiny):
    single = tiny.ground.to(torch.float32)
    assert single.normal.dtype == torch.float32
    loss = ipt.stability_loss(tiny.vertices, tiny.template, single)
    torch.testing.assert_close(
        loss, ipt.stability_loss(tiny.vertices, tiny.template, tiny.ground), rtol=1e-5, atol=1e-6
    )


@pytest.mark.parametrize(
    ("normal", "height", "names"),
    [
        ((0, 0, 0), 0, "normal"),
        ((0, float("nan"), 0), 0, "normal"),
        ((0, 1), 0, "normal"),
        ((0, 1, 0), float("inf"), "height"),
    ],
)
def test_nonsense_is_named(normal, height, names):
    with pytest.raises(ValueError, match=names):
        ipt.Ground(normal, height)


def test_no_silent_zero_gradient(tiny):
    normal, height = torch.tensor([0.0, 1, 0]), torch.tensor(0.0)
    with pytest.raises(ValueError, match="normal.*detach"):
        ipt.Ground(normal.clone().requires_grad_())
    with pytest.raises(ValueError, match="height.*detach"):
        ipt.Ground(normal, height.clone().requires_grad_())

    def by_height(level):
        return ipt.stability_loss(tiny.vertices, tiny.template, ipt.Ground(normal, level)).sum()

    for transform in (torch.func.grad, torch.func.jacfwd):
        with pytest.raises(ValueError, match="height.*detach"):
            transform(by_height)(height)
    later = ipt.Ground(normal, height)
    later.height.requires_grad_()
    with pytest.raises(ValueError, match="requires grad"):
        ipt.stability_loss(tiny.vertices, tiny.template, later)


def test_the_ground_under_bodies_is_that_of_arrays(rng):
    """A float32 body and its numbers in double precision: the same bits, and no gradient."""
    bodies = torch.from_numpy(rng.normal(size=(2, 3, 40, 3))).float().requires_grad_()
    normals = rng.normal(size=(2, 3, 3))
    under, expected = ipt.Ground.under(bodies, normals), ip.Ground.under(bodies.detach().double().numpy(), normals)
    np.testing.assert_allclose(under.height.numpy(), expected.height, rtol=0, atol=1e-15)  # sums in another order
    np.testing.assert_allclose(under.normal.numpy(), expected.normal, rtol=0, atol=1e-15)
    assert under.height.dtype == torch.float64
    assert not under.height.requires_grad
    assert (under.signed_height(bodies.double()).amin(dim=-1).abs() < 1e-14).all()


@pytest.mark.parametrize("shape", [(3,), (0, 3), (5, 2)])
def test_no_ground_lies_under_no_vertices(shape):
    with pytest.raises(ValueError, match=r"vertices: expected \(\.\.\., V, 3\)"):
        ipt.Ground.under(torch.zeros(shape))
