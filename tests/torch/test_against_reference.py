"""The compiled ops against the plain-torch formulas, which find topology and hulls by themselves, in float64."""

from __future__ import annotations

import pytest
import torch

# Sums over 20,000 samples and 24,000 faces in another order: float64 leaves 1e-13 to 1e-12 of them.
VALUE = 1e-10
GRADIENT = 1e-8
# float32 rounds each product to 6e-8; the issue allows this much of a body's gradient (L2).
SINGLE = 1e-5


def relative(ours, theirs):
    """Largest L2 distance of a body's row, relative to the row's length."""
    ours, theirs = ours.flatten(1), theirs.flatten(1)
    same = (ours == theirs).all(dim=1)  # also −inf without contact, and gradients that are zero
    return torch.where(same, 0, (ours - theirs).norm(dim=1) / theirs.norm(dim=1).clamp(min=1e-300)).max().item()


def value_and_gradient(f, vertices, upstream):
    vertices = vertices.clone().requires_grad_()
    value = f(vertices)
    weights = torch.where(value.detach().isfinite(), upstream.to(value.dtype), 0)
    (gradient,) = torch.autograd.grad(value, vertices, weights)
    return value.detach(), gradient


def compare(case, body):
    """Relative errors of value, float64 gradient and float32 gradient."""
    generator = torch.Generator().manual_seed(5)
    upstream = torch.randn(len(body.vertices), case.size(body), generator=generator, dtype=torch.float64)
    value, gradient = value_and_gradient(lambda v: case(v, body), body.vertices, upstream)
    expected, slope = value_and_gradient(lambda v: case.reference(v, body), body.vertices, upstream)
    _, single = value_and_gradient(lambda v: case(v, body), body.vertices.float(), upstream)
    return relative(value, expected), relative(gradient, slope), relative(single.double(), slope)


@pytest.mark.slow
def test_random_poses_of_the_embedded_body(main_case, poses):
    value, gradient, single = compare(main_case, poses)
    assert value < VALUE
    assert gradient < GRADIENT
    assert single < SINGLE


@pytest.mark.slow
def test_real_people_y_down(main_case, people):
    value, gradient, single = compare(main_case, people)
    assert value < VALUE
    assert gradient < GRADIENT
    assert single < SINGLE


def test_every_mode_on_a_tiny_body(case, tiny):
    """The full product of modes, which the large bodies see only in part; and the fused terms are the single ones."""
    value, gradient, single = compare(case, tiny)
    assert value < 1e-12
    assert gradient < 1e-10
    assert single < SINGLE


@pytest.mark.parametrize("verb", ["jvp", "hessian-vector product"])
def test_other_verbs(kind, tiny, verb):
    vertices = tiny.vertices
    direction = torch.randn(vertices.shape, generator=torch.Generator().manual_seed(2), dtype=torch.float64)

    def derivative(f):
        if verb == "jvp":
            return torch.func.jvp(f, (vertices,), (direction,))[1]
        return torch.func.jvp(torch.func.grad(lambda v: f(v).sin().sum()), (vertices,), (direction,))[1]

    ours, theirs = derivative(lambda v: kind(v, tiny)), derivative(lambda v: kind.reference(v, tiny))
    assert relative(ours, theirs) < 1e-10
