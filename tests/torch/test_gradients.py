"""Every op with every option: first and second derivatives, both modes, batched, against finite differences."""

from __future__ import annotations

import pytest
import torch
from torch.autograd import gradcheck, gradgradcheck


def test_gradcheck(case, tiny):
    """Reverse and forward, and both again through vmap. Fast mode compares random projections of the Jacobian."""
    vertices = tiny.vertices[:2].clone().requires_grad_()
    assert gradcheck(
        lambda v: case(v, tiny),
        (vertices,),
        fast_mode=True,
        check_forward_ad=True,
        check_batched_grad=True,
        check_batched_forward_grad=True,
    )


def test_gradcheck_entry_by_entry(kind, tiny):
    """The slow mode, entry by entry, for one quantity of each kind."""
    vertices = tiny.vertices[:1].clone().requires_grad_()
    assert gradcheck(lambda v: kind(v, tiny), (vertices,), check_forward_ad=True)


def test_gradgradcheck(main_case, tiny):
    """d(vjp)/d(d_out) = jvp and d(vjp)/d(vertices) = Hessian-vector product, also forward over reverse."""
    vertices = tiny.vertices[:2].clone().requires_grad_()
    assert gradgradcheck(
        lambda v: main_case(v, tiny), (vertices,), fast_mode=True, check_fwd_over_rev=True, check_batched_grad=True
    )


@pytest.mark.slow
def test_hessian_four_ways(kind, tiny):
    """func.hessian (forward over reverse), reverse over reverse, reverse over forward, and the reference agree."""
    vertices = tiny.vertices[0]

    def f(v):
        return kind(v, tiny).square().sum()

    expected = torch.func.hessian(lambda v: kind.reference(v, tiny).square().sum())(vertices)
    scale = expected.abs().max() + 1e-300
    for name, hessian in (
        ("forward over reverse", torch.func.hessian(f)(vertices)),
        ("reverse over reverse", torch.func.jacrev(torch.func.jacrev(f))(vertices)),
        ("reverse over forward", torch.func.jacrev(torch.func.jacfwd(f))(vertices)),
        ("autograd.functional", torch.autograd.functional.hessian(f, vertices)),
    ):
        # Sums of products of first and second derivatives in another order: 1e-9 of the largest entry.
        assert ((hessian - expected).abs().max() / scale).item() < 1e-9, name


def test_jacobians_agree(kind, tiny):
    vertices = tiny.vertices[:2]
    forward = torch.func.jacfwd(lambda v: kind(v, tiny))(vertices)
    reverse = torch.func.jacrev(lambda v: kind(v, tiny))(vertices)
    torch.testing.assert_close(forward, reverse, rtol=1e-9, atol=1e-9 * reverse.abs().max().item())


def test_per_body_gradients(kind, tiny):
    """vmap over bodies of func.grad is the gradient of the sum, body by body."""
    vertices = tiny.vertices

    def scalar(v):
        return kind(v, tiny).square().sum()

    mapped = torch.func.vmap(torch.func.grad(scalar))(vertices)
    together = torch.func.grad(scalar)(vertices)
    assert torch.equal(mapped, together)


def test_vmap_over_the_ground(tiny):
    """Heights mapped, bodies not: one row a height."""
    import ipman_rs.torch as ipt

    heights = torch.linspace(-0.05, 0.05, 5, dtype=torch.float64)

    def loss(height):
        return ipt.stability_loss(tiny.vertices, tiny.template, ipt.Ground((0.1, 1.0, 0.05), height))

    mapped = torch.func.vmap(loss)(heights)
    assert torch.equal(mapped, torch.stack([loss(height) for height in heights]))


def test_vmap_along_another_axis(kind, tiny):
    vertices = tiny.vertices
    mapped = torch.func.vmap(lambda v: kind(v, tiny), in_dims=1, out_dims=1)(vertices.transpose(0, 1))
    assert torch.equal(mapped.movedim(1, 0), torch.stack([kind(v, tiny) for v in vertices]))


def test_third_derivatives_are_refused(tiny):
    import ipman_rs.torch as ipt

    def f(v):
        return ipt.stability_loss(v, tiny.template, tiny.ground)

    third = torch.func.grad(lambda v: torch.func.grad(lambda w: torch.func.grad(f)(w).square().sum())(v).sum())
    with pytest.raises(NotImplementedError, match="third derivatives"):
        third(tiny.vertices[0])
