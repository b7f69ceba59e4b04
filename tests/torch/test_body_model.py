"""The body model on tensors: equal to numpy's, differentiable, movable."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

import ipman_rs as ip

torch = pytest.importorskip("torch")
from ipman_rs.torch.body import BodyModel  # noqa: E402


@pytest.fixture(params=["anny-lite", "smplx"])
def pair(request, lifelike_arrays, tmp_path):
    """The same body twice, numpy and torch: the embedded one, and a file with every kind of array."""
    if request.param == "smplx":
        np.savez(tmp_path / "x.npz", **lifelike_arrays(55))
        body = ip.load_body(tmp_path / "x.npz")
    else:
        body = ip.load_body(request.param)
    return body, BodyModel(body, dtype=torch.float64)


@pytest.fixture
def tiny():
    """Four joints and three vertices of a body, all of its parts in use."""
    rng = np.random.default_rng(0)
    turned = np.stack([np.linalg.qr(rng.normal(size=(3, 3)))[0] for _ in range(4)])
    turned *= np.linalg.det(turned)[:, None, None]
    weights = rng.random((3, 4))
    body = dataclasses.replace(
        ip.load_body("anny-lite"),
        name="tiny",
        v_template=rng.normal(size=(3, 3)),
        shapedirs=rng.normal(size=(3, 3, 2)),
        expressiondirs=rng.normal(size=(3, 3, 1)),
        posedirs=rng.normal(size=(3, 3, 27)),
        J_template=rng.normal(size=(4, 3)),
        J_shapedirs=rng.normal(size=(4, 3, 2)),
        J_expressiondirs=rng.normal(size=(4, 3, 1)),
        rest_rotation=turned,
        weights=weights / weights.sum(1, keepdims=True),
        parents=np.array([-1, 0, 1, 0]),
        joint_names=("pelvis", "spine1", "spine2", "left_hip"),
    )
    return BodyModel(body, dtype=torch.float64)


@pytest.mark.parametrize("width", [3, 6])
@pytest.mark.parametrize("batch", [(), (4,), (2, 3), (0,)])
def test_equal_to_numpy(pair, width, batch):
    body, model = pair
    rng = np.random.default_rng(0)
    given = {
        "pose": rng.normal(size=(*batch, body.num_joints, width)),
        "betas": rng.normal(size=(*batch, 10)),
        "transl": rng.normal(size=(*batch, 3)),
        "expression": rng.normal(size=(*batch, body.num_expressions)),
    }
    expected = body(**given)
    output = model(**{name: torch.tensor(value) for name, value in given.items()})
    np.testing.assert_allclose(output.vertices, expected.vertices, rtol=0, atol=1e-12)
    np.testing.assert_allclose(output.joints, expected.joints, rtol=0, atol=1e-12)


def test_arguments_broadcast(pair):
    body, model = pair
    pose, betas, transl = torch.randn(5, 1, body.num_joints, 3).double(), torch.randn(4, 10).double(), torch.zeros(3)
    output = model(pose, betas, transl.double())
    assert output.vertices.shape == (5, 4, body.num_vertices, 3)
    np.testing.assert_allclose(output.joints, body(pose.numpy(), betas.numpy()).joints, atol=1e-12)
    assert model(betas=betas[0, :3]).vertices.shape == (body.num_vertices, 3)


def test_single_precision(pair):
    body, model = pair
    pose = np.random.default_rng(0).normal(size=(2, body.num_joints, 3))
    single = model.to(torch.float32)(torch.tensor(pose).float())
    assert single.vertices.dtype == torch.float32
    np.testing.assert_allclose(single.vertices, body(pose).vertices, atol=5e-6)  # 24 rotations in a row at 6e-8 each


def test_a_module_without_parameters_or_state(pair):
    _, model = pair
    assert not list(model.parameters())
    assert not model.state_dict()  # a trainer's checkpoint does not carry the body
    assert model.to("meta").v_template.device.type == "meta"
    assert model.template is model.body.template


def test_buffers_are_copies():
    """Changing the module does not change the shared numpy body."""
    model = BodyModel("anny-lite", dtype=torch.float64)
    model.v_template.add_(1.0)
    assert ip.load_body("anny-lite").v_template.mean() < 0.9


@pytest.mark.parametrize("width", [3, 6])
def test_gradcheck(tiny, width):
    generator = torch.Generator().manual_seed(0)
    given = [
        torch.randn(shape, generator=generator, dtype=torch.float64, requires_grad=True)
        for shape in ((4, width), (2,), (3,), (1,))
    ]
    outputs = lambda *inputs: (tiny(*inputs).vertices, tiny(*inputs).joints)  # noqa: E731
    assert torch.autograd.gradcheck(outputs, given, check_forward_ad=True, check_batched_grad=True)
    assert torch.autograd.gradgradcheck(outputs, given, fast_mode=True)


def test_gradient_at_the_zero_pose(tiny):
    """Zero rotation is where a careless axis-angle formula gives NaN."""
    pose = torch.zeros(4, 3, dtype=torch.float64, requires_grad=True)
    assert torch.autograd.gradcheck(lambda p: tiny(p).vertices, [pose])


def test_vmap_and_jacobian(tiny):
    poses = torch.randn(3, 4, 3, generator=torch.Generator().manual_seed(0), dtype=torch.float64)
    jacobian = torch.func.vmap(torch.func.jacrev(lambda p: tiny(p).vertices))(poses)
    forward = torch.func.vmap(torch.func.jacfwd(lambda p: tiny(p).vertices))(poses)
    assert jacobian.shape == (3, 3, 3, 4, 3)
    torch.testing.assert_close(jacobian, forward, rtol=1e-10, atol=1e-12)


@pytest.mark.parametrize(
    ("arguments", "match"),
    [
        ({"pose": torch.zeros(72)}, "pose: expected"),
        ({"betas": torch.zeros(11)}, r"betas: expected shape \(..., up to 10\), got \(11,\)"),
        ({"transl": torch.zeros(4)}, r"transl: expected shape \(..., 3\), got \(4,\)"),
        ({"expression": torch.zeros(1)}, "expression: expected"),
    ],
)
def test_bad_arguments(arguments, match):
    with pytest.raises(ValueError, match=match):
        BodyModel("anny-lite")(**arguments)
