"""Batches: free dimensions, zero length, positions, threads; bodies that fly, sink or hold a NaN."""

from __future__ import annotations

import math

import numpy as np
import pytest
import torch

import ipman_rs as ip
import ipman_rs.torch as ipt

F64 = torch.float64


@pytest.mark.parametrize("shape", [(), (1,), (4,), (2, 3), (0,), (2, 0), (1, 2, 1)])
@pytest.mark.parametrize("forced", [False, True])
def test_batch_dimensions_are_free(kind, tiny, shape, forced):
    f = kind.reference if forced else kind
    vertices = tiny.vertices[0].expand(*shape, -1, -1).clone().requires_grad_()
    value = f(vertices, tiny)
    assert value.shape == (*shape, kind.size(tiny))
    value.sum().backward()
    assert vertices.grad.shape == vertices.shape
    assert (value == f(tiny.vertices[0], tiny)).all()


def test_one_ground_a_body(tiny):
    heights = torch.linspace(-0.1, 0.1, 6, dtype=F64).reshape(2, 3)
    normals = torch.tensor([[0.0, 1, 0], [0.1, 1, 0], [0, 1, -0.1]], dtype=F64)
    vertices = tiny.vertices[0].expand(2, 3, -1, -1)
    together = ipt.stability_loss(vertices, tiny.template, ipt.Ground(normals, heights))
    for i in range(2):
        for j in range(3):
            ground = ip.Ground(normals[j].numpy(), float(heights[i, j]))
            alone = ipt.stability_loss(tiny.vertices[0], tiny.template, ground)
            assert together[i, j].item() == alone.item()


@pytest.mark.parametrize("dtype", [torch.float64, torch.float32])
def test_same_bits_at_any_place_and_for_any_number_of_threads(kind, tiny, dtype):
    vertices = tiny.vertices.to(dtype)
    batch = torch.cat([vertices[1:], vertices, vertices[:1].expand(30, -1, -1)])

    def both(v):
        v = v.clone().requires_grad_()
        value = kind(v, tiny)
        return value.detach(), torch.autograd.grad(value.sum(), v)[0]

    threads = ip.get_num_threads()
    try:
        results = []
        for number in (1, 2, 5):
            ip.set_num_threads(number)
            results.append(both(batch))
            results.append(both(batch))
    finally:
        ip.set_num_threads(threads)
    for value, gradient in results:
        assert torch.equal(value, results[0][0])
        assert torch.equal(gradient, results[0][1])
    alone = both(vertices[:1])
    for place in (2, 5, 20, 34):
        assert torch.equal(results[0][0][place], alone[0][0])
        assert torch.equal(results[0][1][place], alone[1][0])


@pytest.mark.parametrize("bad", [math.nan, math.inf, -math.inf])
@pytest.mark.parametrize("forced", [False, True])
def test_a_broken_body_stays_alone(kind, tiny, bad, forced):
    f = kind.reference if forced else kind
    sound, broken = tiny.vertices.clone(), tiny.vertices.clone()
    broken[1, 5, 2] = bad
    results = []
    for vertices in (sound, broken):
        vertices.requires_grad_()
        value = f(vertices, tiny)
        value.square().nan_to_num().sum().backward()
        results.append((value.detach(), vertices.grad))
    (value, gradient), (value_broken, gradient_broken) = results
    assert value_broken[1].isnan().all()
    assert (gradient_broken[1] == 0).all()
    for other in (0, 2):
        assert torch.equal(value_broken[other], value[other])
        assert torch.equal(gradient_broken[other], gradient[other])

    tangent = torch.func.jvp(lambda v: f(v, tiny), (broken.detach(),), (torch.ones_like(broken),))[1]
    assert tangent[[0, 2]].isfinite().all()
    assert not tangent[1].isinf().any()


@pytest.mark.parametrize("lift", [100.0, -1.0, 1e-3])
@pytest.mark.parametrize("dtype", [torch.float64, torch.float32])
@pytest.mark.parametrize("forced", [False, True])
def test_hovering_and_sunk_bodies_are_finite(kind, tiny, lift, dtype, forced):
    """No underflow to 0/0, no overflow: finite values and gradients, but for the margin without contact."""
    f = kind.reference if forced else kind
    vertices = (tiny.vertices + lift * tiny.ground.normal).to(dtype).requires_grad_()
    value = f(vertices, tiny)
    if kind.quantity.startswith("support_margin") and lift == 100.0:
        assert (value == -math.inf).all()
    else:
        assert value.isfinite().all()
    torch.where(value.isfinite(), value, 0).sum().backward()
    assert vertices.grad.isfinite().all()
    exact = kind.reference((tiny.vertices + lift * tiny.ground.normal).to(dtype).double(), tiny)
    # 100 m away a float32 coordinate is known to 4 µm, and e^{−γh} with γ = 50 to 2e-4.
    tolerance = 1e-10 if dtype == F64 else (2e-3 if lift == 100.0 else 1e-4)
    # The core's e^x ends at the smallest normal number, not at 0.
    floor = torch.finfo(dtype).tiny + tolerance * exact[exact.isfinite()].abs().sum().item()
    torch.testing.assert_close(value.double(), exact, rtol=tolerance, atol=floor)


def test_flying_has_no_support(tiny):
    flying = (tiny.vertices + 100 * tiny.ground.normal).requires_grad_()
    margin = ipt.support_margin(flying, tiny.template, tiny.ground)
    assert (margin == -math.inf).all()
    (gradient,) = torch.autograd.grad(margin.sum(), flying)
    assert (gradient == 0).all()
    assert not ipt.bose(flying.detach(), tiny.template, tiny.ground).any()
    assert not ipt.bose(flying.detach(), tiny.template, tiny.ground, method="lp").any()
    support = ipt.base_of_support(flying, tiny.template, tiny.ground)
    assert not support.has_contact.any()
    assert not support.inside.any()


def test_stability_is_flat_where_the_points_coincide():
    """CoM over CoP: the norm is 0 and its gradient 0, not NaN. A cube with a single sample."""
    import trimesh

    cube = trimesh.creation.box(extents=(1, 1, 1))
    template = ip.BodyTemplate(cube.vertices, cube.faces, num_samples=1)
    # One sample: both centres are the sample itself.
    vertices = torch.tensor(np.asarray(cube.vertices) + [0, 0.6, 0])[None].requires_grad_()
    for path in (ipt.dispatch._reference_path(), pytest.MonkeyPatch.context()):
        with path:
            loss = ipt.stability_loss(vertices, template, ipt.Ground())
            (gradient,) = torch.autograd.grad(loss.sum(), vertices)
        assert loss.item() < 1e-15
        assert gradient.isfinite().all()


def test_same_numbers_as_numpy(tiny):
    """Names, defaults and argument order are those of the numpy functions, also for a body of one part."""
    ground, vertices, template = tiny.ground, tiny.vertices, tiny.template
    plane = ip.Ground(ground.normal.numpy(), ground.height.numpy())
    array = vertices.numpy()
    for name, arguments in (
        ("part_volumes", ()),
        ("sample_surface", ()),
        ("center_of_mass", ()),
        ("center_of_mass", ("face_area",)),
        ("pressure", (plane, 70.0, 20.0)),
        ("center_of_pressure", (plane, 70.0, 20.0, 1e-6)),
        ("support_margin", (plane, 0.15, "exact", "released")),
        ("bose", (plane, 0.15, "lp", "exact", "released")),
        ("bose", (plane, 0.15, "hull", "exact", "released")),
        ("stability_loss", (plane, 70.0, 20.0, 1e-6, "exact")),
        ("ground_loss", (plane, 2.0, 0.3, 3.0, 0.1, "vertices", "tanh_of_square")),
        ("balance_cost", (plane, 70.0, 20.0, 0.03, "saturate", "exact")),
        ("body_status", (plane, 0.05, "released")),
    ):
        ours, theirs = (
            getattr(ipt, name)(vertices, template, *arguments),
            getattr(ip, name)(array, template, *arguments),
        )
        for our, their in zip(*((x if isinstance(x, tuple) else (x,)) for x in (ours, theirs)), strict=True):
            assert np.array_equal(our.numpy(), their), name
    ours, theirs = ipt.mass_properties(vertices, template, 900.0), ip.mass_properties(array, template, 900.0)
    assert np.array_equal(ours.inertia.numpy(), theirs.inertia)
    assert np.array_equal(ours.parts.center.numpy(), theirs.parts.center)
    assert (
        ipt.base_of_support(vertices, template, plane).area.tolist()
        == ip.base_of_support(array, template, plane).area.tolist()
    )
    whole = ip.BodyTemplate(template.vertices, template.faces, num_samples=50)
    for t in (template, whole):
        analysis = ipt.analyze(vertices, t, ground)
        assert analysis.to_json() == ip.analyze(array, t, plane).to_json()
    analysis = ipt.analyze(vertices.clone().requires_grad_(), template, ground)
    assert analysis.base_of_support.margin.requires_grad
    assert analysis.balance.requires_grad


@pytest.mark.parametrize(
    ("change", "error", "names"),
    [
        (lambda v: v.numpy(), TypeError, "vertices"),
        (lambda v: v.long(), TypeError, "vertices"),
        (lambda v: v[0, 0], ValueError, "vertices"),
        (lambda v: v[..., :2], ValueError, "vertices"),
        (lambda v: v[:, :-1], ValueError, "vertices"),
    ],
)
def test_wrong_vertices_are_named(tiny, change, error, names):
    with pytest.raises(error, match=names):
        ipt.stability_loss(change(tiny.vertices), tiny.template, tiny.ground)


@pytest.mark.parametrize(
    ("call", "names"),
    [
        (lambda v, t, g: ipt.center_of_mass(v, t, "pc"), "method"),
        (lambda v, t, g: ipt.stability_loss(v, t, g, method="x"), "method"),
        (lambda v, t, g: ipt.support_margin(v, t, g, contact="x"), "contact"),
        (lambda v, t, g: ipt.support_margin(v, t, g, threshold=0.0), "threshold"),
        (lambda v, t, g: ipt.ground_loss(v, t, g, points="x"), "points"),
        (lambda v, t, g: ipt.ground_loss(v, t, g, curve="x"), "curve"),
        (lambda v, t, g: ipt.ground_loss(v, t, g, alpha2=-1.0), "alpha2"),
        (lambda v, t, g: ipt.balance_cost(v, t, g, wrap="x"), "wrap"),
        (lambda v, t, g: ipt.balance_cost(v, t, g, sigma=0.0), "sigma"),
        (lambda v, t, g: ipt.bose(v, t, g, method="x"), "method"),
        (lambda v, t, g: ipt.mass_properties(v, t, [1.0, 2.0]), "density"),
        (lambda v, t, g: ipt.stability_loss(v, t, ipt.Ground(height=torch.zeros(7))), "ground"),
    ],
)
def test_wrong_arguments_are_named(tiny, call, names):
    with pytest.raises(ValueError, match=names):
        call(tiny.vertices, tiny.template, tiny.ground)
    with pytest.raises(TypeError, match="ground"):
        ipt.stability_loss(tiny.vertices, tiny.template, (0, 1, 0))
