"""The compiled skinning: against the plain formulas in float64, its derivatives, its bits, bad input."""

from __future__ import annotations

import copy
import pickle

import numpy as np
import pytest

import ipman_rs as ip
from ipman_rs import _core

torch = pytest.importorskip("torch")
from ipman_rs.torch import dispatch  # noqa: E402
from ipman_rs.torch import skinning as ops  # noqa: E402
from ipman_rs.torch.body import BodyModel  # noqa: E402


@pytest.fixture(scope="module", params=["anny", "with every array"])
def model(request, lifelike_arrays, tmp_path_factory):
    """The embedded body, and a file with pose shapes, expressions and hands."""
    if request.param == "anny":
        return BodyModel("anny", dtype=torch.float64)
    path = tmp_path_factory.mktemp("skinning") / "x.npz"
    np.savez(path, **lifelike_arrays(55))
    return BodyModel(ip.load_body(path), dtype=torch.float64)


def parameters(model, count, width=3, dtype=torch.float64, seed=0):
    """pose, betas, translation, expression of some bodies."""
    generator = torch.Generator().manual_seed(seed)
    tails = ((model.body.num_joints, width), (10,), (3,), (model.body.num_expressions,))
    given = [torch.randn(count, *tail, generator=generator, dtype=torch.float64) for tail in tails]
    return [value.to(dtype).requires_grad_() for value in given]


def with_gradients(model, given, seed=1):
    """Vertices, joints and the gradients of a random weighting of both."""
    output = model(*given)
    generator = torch.Generator().manual_seed(seed)
    upstream = [
        torch.randn(out.shape, generator=generator, dtype=torch.float64).to(out.dtype) for out in vars(output).values()
    ]
    asked = [value for value in given if value.numel()]
    gradients = torch.autograd.grad(list(vars(output).values()), asked, upstream)
    return [output.vertices.detach(), output.joints.detach(), *gradients]


def largest_error(got, exact):
    """Of each result, relative to its largest number."""
    return [float((a.double() - b).abs().max() / b.abs().max()) for a, b in zip(got, exact, strict=True)]


@pytest.mark.parametrize("width", [3, 6])
def test_double_precision_against_plain_torch(model, width):
    """1e-12: sums of up to 37,000 products, in another order."""
    given = parameters(model, 3, width)
    got = with_gradients(model, given)
    with dispatch._reference_path():
        exact = with_gradients(model, given)
    assert max(largest_error(got, exact)) < 1e-12


@pytest.mark.parametrize("width", [3, 6])
def test_single_precision_is_as_good_as_plain_torch(model, width):
    given = parameters(model, 4, width, torch.float32)
    single = BodyModel(model.body, dtype=torch.float32)
    got = largest_error(
        with_gradients(single, given),
        exact := with_gradients(model, [g.detach().double().requires_grad_() for g in given]),
    )
    with dispatch._reference_path():
        plain = largest_error(with_gradients(single, given), exact)
    # Both are the largest of many roundings, whose order differs by processor and BLAS: such maxima differ by up to
    # half between processors (1.33 was seen). An error of the formula would be 1e4 times as large.
    assert all(a <= max(2 * b, 2.4e-7) for a, b in zip(got, plain, strict=True)), (got, plain)


@pytest.mark.parametrize("angle", [0.0, 1e-8, 1.0, np.pi - 1e-7, np.pi, 2 * np.pi, 7.0])
def test_gradient_at_special_angles(model, angle):
    """At zero, where series and closed form meet, at half and full turns: against plain numerical differences."""
    pose = torch.zeros(1, model.body.num_joints, 3, dtype=torch.float64)
    axis = torch.nn.functional.normalize(
        torch.randn(pose.shape[1:], generator=torch.Generator().manual_seed(0)).double(), dim=-1
    )
    pose[0] = angle * axis
    pose.requires_grad_()
    probe = torch.randn(1, model.body.num_joints, 3, generator=torch.Generator().manual_seed(1)).double()

    def energy(p):
        return (model(p).joints * probe).sum() + model(p).vertices[..., ::7, :].square().sum() / 1000

    (gradient,) = torch.autograd.grad(energy(pose), pose)
    for joint, axis in ((0, 0), (3, 1), (16, 2)):
        step = torch.zeros_like(pose)
        step[0, joint, axis] = 1e-5
        with torch.no_grad():
            slope = float(energy(pose + step) - energy(pose - step)) / 2e-5
        assert abs(float(gradient[0, joint, axis]) - slope) < 1e-7 * max(1.0, abs(slope))


@pytest.mark.parametrize("dtype", [torch.float32, torch.float64])
def test_same_bits_in_every_batch_and_with_every_number_of_threads(model, dtype):
    model = BodyModel(model.body, dtype=dtype)
    given = parameters(model, 19, dtype=dtype)
    whole = with_gradients(model, given)
    before = ip.get_num_threads()
    try:
        for threads in (1, 2, 5):
            ip.set_num_threads(threads)
            again = with_gradients(model, given)
            assert all(torch.equal(a, b) for a, b in zip(whole, again, strict=True))
    finally:
        ip.set_num_threads(before)
    alone = model(*(value[17:18] for value in given))
    assert torch.equal(alone.vertices[0], whole[0][17])
    assert torch.equal(alone.joints[0], whole[1][17])


def test_a_shared_shape_changes_no_bit(model):
    """Shared betas are blended once for all bodies, zero ones not at all."""
    pose, betas, transl, _ = parameters(model, 5)
    shared = betas[:1].expand(5, 10)
    assert torch.equal(model(pose, betas[0], transl).vertices, model(pose, shared.clone(), transl).vertices)
    assert torch.equal(model(pose, 0 * betas, transl).vertices, model(pose, None, transl).vertices)
    numpy_pose = pose.detach().numpy()
    one, many = (model.body(numpy_pose, b.detach().numpy()).vertices for b in (betas[0], shared.clone()))
    np.testing.assert_array_equal(one, many)


def test_a_broken_body_has_no_gradient_and_disturbs_none(model):
    given = parameters(model, 5)
    clean = with_gradients(model, given)
    for value, at in zip(given[:3], ((2, 4, 1), (2, 3), (2, 0)), strict=True):
        broken = [v.detach().clone().requires_grad_() for v in given]
        with torch.no_grad():
            broken[[v is value for v in given].index(True)][at] = float("nan")
        got = with_gradients(model, broken)
        others = [0, 1, 3, 4]
        assert all(torch.equal(a[others], b[others]) for a, b in zip(got, clean, strict=True))
        assert all(part[2].isnan().all() for part in got[:2])
        assert all((part[2] == 0).all() for part in got[2:])


def test_gradients_of_some_parameters_only(model):
    given = parameters(model, 2)
    full = with_gradients(model, given)
    for index in range(3):
        some = [value.detach().requires_grad_(i == index) for i, value in enumerate(given)]
        output = model(*some)
        generator = torch.Generator().manual_seed(1)
        upstream = [torch.randn(out.shape, generator=generator, dtype=torch.float64) for out in vars(output).values()]
        (gradient,) = torch.autograd.grad(list(vars(output).values()), some[index], upstream)
        torch.testing.assert_close(gradient, full[2 + index], rtol=1e-13, atol=1e-13)


def test_joints_alone(model):
    """Without an upstream gradient of the vertices none is made up."""
    given = parameters(model, 2)[:3]
    got = torch.autograd.grad(model(*given).joints.square().sum(), given)
    with dispatch._reference_path():
        expected = torch.autograd.grad(model(*given).joints.square().sum(), given)
    for a, b in zip(got, expected, strict=True):
        torch.testing.assert_close(a, b, rtol=1e-12, atol=1e-12)


@pytest.mark.slow
@pytest.mark.parametrize("op", ["skin", "skin_vjp", "skin_jvp", "skin_vjp_jvp"])
def test_opcheck(op):
    body = ip.load_body("anny-lite")
    pose, betas, transl = torch.randn(2, 24, 3), torch.randn(2, 10), torch.randn(2, 3)
    upstream, along = (torch.randn(2, 1229, 3), None), (pose, None, None, transl)
    more = {"skin_vjp": [*upstream, 0b1011], "skin_jvp": along, "skin_vjp_jvp": [*upstream, *along, 0b0001]}.get(op, [])
    torch.library.opcheck(getattr(ops, op), (pose, betas, None, transl, *more, body._key))


@pytest.mark.slow
@pytest.mark.parametrize("forced", [False, True])
def test_compile_fullgraph(forced):
    torch.compiler.reset()
    model = BodyModel("anny-lite", dtype=torch.float64)
    given = parameters(model, 2)[:3]

    def f(pose, betas, transl):
        output = model(pose, betas, transl)
        return output.vertices.square().sum() + output.joints.sum()

    with dispatch._reference_path() if forced else pytest.MonkeyPatch.context():
        expected = f(*given)
        gradients = torch.autograd.grad(expected, given)
        compiled = torch.compile(f, fullgraph=True, backend="aot_eager")
        got = compiled(*given)
        torch.testing.assert_close(got, expected, rtol=1e-13, atol=0)
        for a, b in zip(torch.autograd.grad(got, given), gradients, strict=True):
            torch.testing.assert_close(a, b, rtol=1e-12, atol=1e-12)


def test_autocast_and_half_parameters():
    """Half parameters of a single-precision body are computed in single precision."""
    model = BodyModel("anny-lite", dtype=torch.float32)
    pose = torch.randn(2, 24, 3).bfloat16().requires_grad_()
    with torch.autocast("cpu", torch.bfloat16):
        vertices = model(pose).vertices
    assert vertices.dtype == torch.float32
    assert torch.equal(vertices, model(pose.float()).vertices)
    vertices.sum().backward()
    assert pose.grad is not None
    assert pose.grad.dtype == torch.bfloat16


def test_third_derivatives_are_refused():
    model = BodyModel("anny-lite", dtype=torch.float64)
    pose = torch.randn(1, 24, 3, dtype=torch.float64, requires_grad=True)
    (first,) = torch.autograd.grad(model(pose).vertices.square().sum(), pose, create_graph=True)
    (second,) = torch.autograd.grad(first.square().sum(), pose, create_graph=True)
    with pytest.raises(NotImplementedError, match="third derivatives"):
        torch.autograd.grad(second.sum(), pose)


def test_outputs_share_no_memory_with_inputs(model):
    given = parameters(model, 1)[:3]
    output = model(*given)
    gradients = torch.autograd.grad(output.vertices.sum(), given)
    tensors = [*given, output.vertices, output.joints, *gradients]
    assert len({tensor.untyped_storage().data_ptr() for tensor in tensors}) == len(tensors)


def test_copies_and_pickles(model):
    model.body()  # has made its compiled form
    for twin in (copy.deepcopy(model), pickle.loads(pickle.dumps(model))):
        assert twin.body is not model.body
        assert torch.equal(twin().vertices, model().vertices)


def skin(**changes):
    """A skin of two joints and one vertex, with other arrays in place of some."""
    arrays = {
        "v_template": np.zeros((1, 3)),
        "shapedirs": np.zeros((1, 3, 2)),
        "expressiondirs": np.zeros((1, 3, 0)),
        "posedirs": np.zeros(0),
        "joints": np.zeros((2, 3)),
        "joint_shapes": np.zeros((2, 3, 2)),
        "joint_expressions": np.zeros((2, 3, 0)),
        "rest_rotation": np.tile(np.eye(3), (2, 1, 1)),
        "pose_mean": np.zeros((2, 3)),
        "weights": np.array([[0.25, 0.75]]),
        "parents": np.array([-1, 0]),
    }
    return _core.Skin(*(arrays | changes).values(), single=False)


@pytest.mark.parametrize(
    ("changes", "match"),
    [
        ({"parents": np.array([-1, 1])}, "parents: expected every parent before its children.* parent 1 of joint 1"),
        ({"weights": np.array([[0.25, 0.7]])}, "weights: expected rows that sum to 1, got 0.95 at vertex 0"),
        ({"weights": np.ones((1, 3))}, "weights: expected 2 numbers, got 3"),
        ({"joint_shapes": np.zeros((2, 3, 3))}, "J_shapedirs: expected 12 numbers, got 18"),
        ({"posedirs": np.zeros((1, 3, 8))}, "posedirs: expected 27 numbers, got 24"),
        ({"v_template": np.array([[0.0, np.nan, 0.0]])}, "v_template: expected finite numbers, got NaN at position 1"),
        ({"v_template": np.zeros((0, 3))}, "v_template: expected at least one row, got none"),
    ],
)
def test_bad_models(changes, match):
    with pytest.raises(ValueError, match=match):
        skin(**changes)


def test_bad_arguments_of_the_core():
    core, vertices, joints = skin(), np.zeros((2, 1, 3)), np.zeros((2, 2, 3))
    pose = np.zeros((2, 2, 3))
    core.forward(2, (pose, None, None, None), vertices, joints)
    with pytest.raises(ValueError, match="pose: expected 2 rows or one"):
        core.forward(2, (np.zeros((3, 2, 3)), None, None, None), vertices, joints)
    with pytest.raises(ValueError, match="betas: expected 2 numbers, got 3"):
        core.forward(2, (pose, np.zeros((2, 3)), None, None), vertices, joints)
    with pytest.raises(ValueError, match="vertices: expected 6 numbers, got 3"):
        core.forward(2, (pose, None, None, None), vertices[:1], joints)
    with pytest.raises(TypeError, match="pose: expected an array of the skin's dtype"):
        core.forward(2, (pose.astype(np.float32), None, None, None), vertices, joints)


def test_batches_that_do_not_fit():
    with pytest.raises(ValueError, match=r"do not fit together: pose \(2,\), betas \(3,\)"):
        BodyModel("anny-lite")(torch.zeros(2, 24, 3), torch.zeros(3, 10))
