"""What the tuned path of other devices must do, whichever code runs it: torch operations, or Triton's interpreter."""

from __future__ import annotations

import torch

import ipman_rs as ip
import ipman_rs.torch as ipt
from ipman_rs.torch.dispatch import _device_path, _reference_path

CURVES = ("tanh_squared", "tanh_of_square")
PRESETS = ("paper-r", "paper-o", "released")
UNIT = {"stability": 1.0, "pull": 0.7, "push": 1.3}


def loss_of(template, preset="paper-r", curve="tanh_squared", weights=UNIT, reduction="none"):
    return ipt.IntuitivePhysicsLoss(template, preset, reduction, weights, curve=curve)


def weighted(loss, vertices, ground, path):
    """Terms (B, 3) and the gradient of the sum of the weighted totals."""
    vertices = vertices.clone().requires_grad_()
    with path():
        total, terms = loss.weighted(vertices, ground)
        total.sum().backward()
    return torch.stack(list(terms.values()), dim=-1), vertices.grad


def separate(loss, vertices, ground, path):
    vertices = vertices.clone().requires_grad_()
    with path():
        terms = loss(vertices, ground)
        sum(loss.weights[name] * term.sum() for name, term in terms.items()).backward()
    return torch.stack(list(terms.values()), dim=-1).detach(), vertices.grad


def distance(ours, theirs):
    """The largest L2 distance of a body's row, relative to the row."""
    ours, theirs = ours.double().flatten(1), theirs.double().flatten(1)
    return ((ours - theirs).norm(dim=1) / theirs.norm(dim=1)).max().item()


def people(body: ip.body.BodyModel, count: int, far: float = 0.0):
    """Random poses with a ground each: hovering, sunk, standing, deep. Coordinates that float32 has too."""
    generator = torch.Generator().manual_seed(3)
    pose = 0.3 * torch.randn(count, body.num_joints, 3, generator=generator, dtype=torch.float64)
    vertices = torch.from_numpy(body(pose.numpy()).vertices) + torch.tensor([far, 0.0, -far])
    normal = torch.nn.functional.normalize(torch.tensor([0.05, 1.0, 0.02], dtype=torch.float64), dim=0)
    vertices = vertices.float().double()
    lowest = (vertices @ normal).amin(dim=-1)
    depth = torch.tensor([-0.3, 0.03, 0.0, 1.0], dtype=torch.float64).repeat(count)[:count]
    return vertices, ipt.Ground(normal, lowest + depth)


def check_against_the_reference(body, preset, curve, count, far, single):
    """Values and both gradients: float64 to rounding, float32 within 1e-5 and no worse than eager torch in float32."""
    vertices, ground = people(body, count, far)
    loss = loss_of(body.template, preset, curve)
    value, slope = weighted(loss, vertices, ground, _reference_path)
    # Up to 100 m / 1 m of the 16 digits are lost where the reference works in the world's coordinates.
    tolerance = 1e-11 if far else 1e-12
    for run in (weighted, separate):
        ours, gradient = run(loss, vertices, ground, _device_path)
        assert distance(ours, value) < tolerance
        assert distance(gradient, slope) < tolerance
        ours, gradient = run(loss, vertices.float(), ground, _device_path)
        assert ours.dtype == gradient.dtype == torch.float32
        assert distance(ours, value) < single
        assert distance(gradient, slope) < single
    _, eager = weighted(loss, vertices.float(), ground, _reference_path)
    assert distance(gradient, slope) <= distance(eager, slope)


def check_a_broken_body(tiny):
    """NaN or infinity in one body: NaN terms, zero gradient, and the others as without it, to the bit."""
    loss = loss_of(tiny.template)
    batch = ipt.dispatch.bodies(tiny.vertices, tiny.template, tiny.ground)
    for trouble in (torch.nan, torch.inf):
        broken = tiny.vertices.clone()
        broken[1, 7, 2] = trouble
        for run in (weighted, separate):
            sound, slope = run(loss, tiny.vertices, tiny.ground, _device_path)
            ours, gradient = run(loss, broken, tiny.ground, _device_path)
            assert torch.equal(ours[[0, 2]], sound[[0, 2]])
            assert torch.equal(gradient[[0, 2]], slope[[0, 2]])
            assert (ours[1] == 0).all()  # the loss leaves it out
            assert (gradient[1] == 0).all()
        with _device_path():
            raw = ipt.dispatch.values_of(batch._replace(vertices=broken), tiny.template, loss._quantity)
        assert raw[1].isnan().all()
        assert raw[[0, 2]].isfinite().all()


def check_no_bodies(tiny):
    loss = loss_of(tiny.template, reduction="mean")
    for run in (weighted, separate):
        terms, gradient = run(loss, tiny.vertices[:0], tiny.ground, _device_path)
        assert (terms == 0).all()
        assert gradient.shape == (0, 42, 3)


def check_derivatives(tiny):
    """First by hand, second and forward through the reference."""
    loss = loss_of(tiny.template)
    vertices = tiny.vertices[:2].clone().requires_grad_()
    with _device_path():
        for f in (
            lambda v: loss.weighted(v, tiny.ground)[0],
            lambda v: torch.stack(list(loss(v, tiny.ground).values())),
        ):
            assert torch.autograd.gradcheck(f, (vertices,), fast_mode=True, check_forward_ad=True)
            assert torch.autograd.gradgradcheck(f, (vertices,), fast_mode=True)


def check_compiled(tiny, backend="aot_eager"):
    """One graph; another batch size; and the same gradients."""
    torch.compiler.reset()
    loss = loss_of(tiny.template, reduction="mean")
    with _device_path():
        for f in (
            lambda v: loss.weighted(v, tiny.ground)[0],
            lambda v: sum(loss(v, tiny.ground).values()),
        ):
            compiled = torch.compile(f, fullgraph=True, backend=backend)
            for count in (3, 2):
                vertices = tiny.vertices[:count].clone().requires_grad_()
                (expected,) = torch.autograd.grad(f(vertices), vertices)
                (gradient,) = torch.autograd.grad(compiled(vertices), vertices)
                torch.testing.assert_close(gradient, expected, rtol=1e-12, atol=1e-15)
