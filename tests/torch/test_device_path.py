"""The tuned path of other devices, in torch operations, forced on CPU tensors; and what only a GPU can show."""

from __future__ import annotations

import subprocess
import sys

import pytest
import torch
from torch.utils._python_dispatch import TorchDispatchMode

import ipman_rs as ip
import ipman_rs.torch as ipt
from ipman_rs.torch.dispatch import _device_path, _reference_path
from tests.helpers import device_cases as cases


@pytest.fixture(scope="module")
def lite():
    return ip.load_body("anny-lite")


@pytest.mark.parametrize("preset", cases.PRESETS)
@pytest.mark.parametrize("curve", cases.CURVES)
@pytest.mark.parametrize("far", [0.0, 100.0])
def test_against_the_reference(lite, preset, curve, far):
    cases.check_against_the_reference(lite, preset, curve, 4, far, single=1e-5)


def test_the_full_body(anny):
    cases.check_against_the_reference(anny, "paper-r", "tanh_squared", 2, 100.0, single=1e-5)


@pytest.fixture(scope="module")
def anny():
    return ip.load_body("anny")


def test_a_broken_body(tiny):
    cases.check_a_broken_body(tiny)


def test_no_bodies(tiny):
    cases.check_no_bodies(tiny)


def test_derivatives(tiny):
    cases.check_derivatives(tiny)


@pytest.mark.slow
def test_compile_fullgraph(tiny):
    cases.check_compiled(tiny)


def test_one_part_and_open_edges(tiny):
    """No virtual vertices at all, and an open mesh that is closed through one."""
    old = tiny.template
    for faces in (old.faces, old.faces[1:]):
        template = ip.BodyTemplate(old.vertices, faces, num_samples=100)
        loss = cases.loss_of(template)
        value, slope = cases.weighted(loss, tiny.vertices, tiny.ground, _reference_path)
        ours, gradient = cases.weighted(loss, tiny.vertices, tiny.ground, _device_path)
        assert cases.distance(ours, value) < 1e-12
        assert cases.distance(gradient, slope) < 1e-12


def test_function_transforms_take_the_reference(tiny):
    loss = cases.loss_of(tiny.template, reduction="sum")

    def total(v):
        return loss.weighted(v, tiny.ground)[0]

    with _device_path():
        mapped = torch.func.vmap(torch.func.grad(total))(tiny.vertices[:, None])[:, 0]
        hessian = torch.func.hessian(total)(tiny.vertices[:1])
    _, slope = cases.weighted(loss, tiny.vertices, tiny.ground, _reference_path)
    torch.testing.assert_close(mapped, slope, rtol=1e-10, atol=1e-14)
    with _reference_path():
        torch.testing.assert_close(hessian, torch.func.hessian(total)(tiny.vertices[:1]))


def test_a_batch_of_upstream_gradients(tiny):
    """is_grads_batched maps over the backward alone."""
    loss = cases.loss_of(tiny.template)
    vertices = tiny.vertices.clone().requires_grad_()
    with _device_path():
        term = loss(vertices, tiny.ground)["stability"]
        (rows,) = torch.autograd.grad(term, vertices, torch.eye(3, dtype=term.dtype), is_grads_batched=True)
        (all_of_it,) = torch.autograd.grad(loss(vertices, tiny.ground)["stability"].sum(), vertices)
    torch.testing.assert_close(rows.sum(dim=0), all_of_it, rtol=1e-12, atol=1e-15)


class Recorder(TorchDispatchMode):
    """The names of all operations that run."""

    def __init__(self):
        super().__init__()
        self.names = set()

    def __torch_dispatch__(self, function, types, args=(), kwargs=None):
        self.names.add(function.name().split("::")[1])
        return function(*args, **(kwargs or {}))


# What reads a value back, has a shape that depends on data, copies from the host, or adds in no fixed order.
WAITING = ("_local_scalar_dense", "is_nonzero", "item", "equal", "nonzero", "masked_select", "unique", "lift_fresh")
UNORDERED = ("index_put", "index_add", "scatter", "embedding_dense_backward")


@pytest.mark.parametrize("run", [cases.weighted, cases.separate])
@pytest.mark.parametrize("device", ["meta", "cpu"])
def test_nothing_waits_for_the_device(tiny, run, device):
    """By construction, as no GPU is needed to see it: a meta tensor has no value to read, and no operation asks."""
    vertices, ground = tiny.vertices.to(device), tiny.ground.to(device)
    loss = cases.loss_of(tiny.template, reduction="mean")
    run(loss, vertices, ground, _device_path)  # the tables are built at the first call
    with Recorder() as recorder:
        run(loss, vertices, ground, _device_path)
    allowed = ("lift_fresh",) if device == "cpu" else ()  # weights go into a CPU tensor as ever
    found = [n for n in recorder.names if n.startswith(WAITING + UNORDERED) and not n.startswith(allowed)]
    assert found == []
    assert "index_select" in recorder.names  # the tuned path ran


@pytest.mark.slow
def test_importing_needs_no_triton():
    code = "import sys; sys.modules['triton'] = None; import ipman_rs.torch as t"
    code += "; assert not t.device.triton_terms.INSTALLED"
    subprocess.run([sys.executable, "-c", code], check=True)


@pytest.mark.skipif(not torch.cuda.is_available(), reason="no GPU here: CUDA is measured and captured where one is")
def test_on_a_gpu(lite):
    """No synchronisation, the same numbers as the reference, the same bits twice and from a CUDA graph."""
    vertices, ground = cases.people(lite, 4)
    loss = cases.loss_of(lite.template, reduction="mean")
    expected, slope = cases.weighted(loss, vertices, ground, _reference_path)
    ground, static = ground.to("cuda"), vertices.float().cuda().requires_grad_()

    def step():
        total, terms = loss.weighted(static, ground)
        (gradient,) = torch.autograd.grad(total, static)
        return torch.stack(list(terms.values())), gradient

    stream = torch.cuda.Stream()
    with torch.cuda.stream(stream):
        for _ in range(3):
            step()
    torch.cuda.synchronize()
    torch.cuda.set_sync_debug_mode("error")
    try:
        terms, gradient = step()
    finally:
        torch.cuda.set_sync_debug_mode("default")
    graph = torch.cuda.CUDAGraph()
    with torch.cuda.graph(graph):
        captured_terms, captured = step()
    graph.replay()
    assert torch.equal(captured, gradient)
    assert torch.equal(captured_terms, terms)
    assert cases.distance(gradient.cpu(), slope) < 1e-5
    torch.testing.assert_close(terms.cpu().double(), expected, rtol=1e-5, atol=1e-7)


BAD_OPTIONS = [
    (ipt.pressure, "alpha", torch.nan),
    (ipt.pressure, "gamma", torch.inf),
    (ipt.center_of_pressure, "alpha", torch.nan),
    (ipt.center_of_pressure, "gamma", torch.nan),
    (ipt.center_of_pressure, "epsilon", -1e-6),
    (ipt.center_of_pressure, "epsilon", torch.nan),
    (ipt.stability_loss, "alpha", torch.nan),
    (ipt.stability_loss, "gamma", torch.inf),
    (ipt.stability_loss, "epsilon", -1.0),
    (ipt.ground_loss, "alpha1", torch.nan),
    (ipt.ground_loss, "alpha2", 0.0),
    (ipt.ground_loss, "beta1", torch.nan),
    (ipt.ground_loss, "beta2", -1.0),
    (ipt.balance_cost, "alpha", torch.nan),
    (ipt.balance_cost, "gamma", torch.nan),
    (ipt.balance_cost, "sigma", 0.0),
    (ipt.support_margin, "threshold", torch.nan),
    (ipt.bose, "threshold", -0.1),
]


@pytest.mark.parametrize(("function", "name", "value"), BAD_OPTIONS, ids=lambda x: getattr(x, "__name__", str(x)))
@pytest.mark.parametrize("path", [_device_path, _reference_path, pytest.MonkeyPatch.context])
def test_bad_options_are_named_as_in_numpy(tiny, function, name, value, path):
    """The same words as numpy's, on every path."""
    with path(), pytest.raises(ValueError, match=f"^{name}: ") as ours:
        function(tiny.vertices, tiny.template, tiny.ground, **{name: value})
    numpy_function = getattr(ip, function.__name__)
    with pytest.raises(ValueError, match=f"^{name}: ") as theirs:
        numpy_function(tiny.vertices.numpy(), tiny.template, ip.Ground(), **{name: value})
    assert str(ours.value) == str(theirs.value)


def test_options_that_are_no_numbers(tiny):
    with pytest.raises(TypeError, match="alpha"):
        ipt.pressure(tiny.vertices, tiny.template, tiny.ground, alpha="steep")
