"""torch.compile, autocast, opcheck, aliasing, DataLoader workers: the ways torch runs code that is not plain eager."""

from __future__ import annotations

import gc

import pytest
import torch

import ipman_rs as ip
import ipman_rs.torch as ipt
from ipman_rs.torch.dispatch import evaluate


def gradient_of(f, vertices):
    vertices = vertices.clone().requires_grad_()
    f(vertices).square().sum().backward()
    return vertices.grad


@pytest.fixture(autouse=True)
def fresh_compiler():
    torch.compiler.reset()


@pytest.mark.slow
@pytest.mark.parametrize("path", ["compiled core", "reference"])
def test_compile_fullgraph(kind, tiny, path):
    """One graph, forward and backward, on both paths. The backend is the tracer alone: no C++ compiler is needed."""
    forced = ipt.dispatch._reference_path

    quantity = kind.on(tiny)

    def f(v):
        return evaluate(v, tiny.template, tiny.ground, quantity)

    with forced() if path == "reference" else pytest.MonkeyPatch.context():
        expected, slope = f(tiny.vertices), gradient_of(f, tiny.vertices)
        compiled = torch.compile(f, fullgraph=True, backend="aot_eager")
        assert torch.equal(compiled(tiny.vertices), expected)
        torch.testing.assert_close(gradient_of(compiled, tiny.vertices), slope, rtol=1e-12, atol=1e-15)


@pytest.mark.slow
def test_compile_with_a_numpy_ground_and_another_batch(tiny):
    ground = ip.Ground((0.1, 1.0, 0.05), 0.01)

    @torch.compile(fullgraph=True, backend="aot_eager", dynamic=True)
    def f(v):
        return ipt.stability_loss(v, tiny.template, ground)

    for shape in ((1,), (3,), (2,), (), (2, 2), (3, 2)):
        vertices = tiny.vertices[0].expand(*shape, -1, -1)
        assert torch.equal(f(vertices), ipt.stability_loss(vertices, tiny.template, tiny.ground))


@pytest.mark.slow
def test_compile_with_a_ground_made_inside(tiny):
    normals, heights = tiny.ground.normal.expand(3, 3), torch.linspace(-0.02, 0.02, 3)

    def f(v, normal, height):
        return ipt.stability_loss(v, tiny.template, ipt.Ground(normal, height))

    compiled = torch.compile(f, fullgraph=True, backend="aot_eager")
    assert torch.equal(compiled(tiny.vertices, normals, heights), f(tiny.vertices, normals, heights))


@pytest.mark.slow
def test_compile_inductor(tiny):
    """The default backend on the loss that trainers compile."""
    loss = ipt.IntuitivePhysicsLoss(tiny.template)
    vertices = tiny.vertices.clone().requires_grad_()
    try:
        total, _ = torch.compile(loss.weighted, fullgraph=True)(vertices, tiny.ground)
    except torch._inductor.exc.InductorError as error:
        pytest.skip(f"inductor does not run here: {error}")
    total.backward()
    again = tiny.vertices.clone().requires_grad_()
    loss.weighted(again, tiny.ground)[0].backward()
    torch.testing.assert_close(vertices.grad, again.grad, rtol=1e-12, atol=1e-15)


@pytest.mark.slow
@pytest.mark.parametrize("verb", ["value", "vjp", "jvp", "hvp", "value_and_vjp"])
def test_opcheck(kind, tiny, verb):
    vertices, batch = tiny.vertices, len(tiny.vertices)
    normal, height = tiny.ground.normal.expand(batch, 3), tiny.ground.height.expand(batch)
    d_out = torch.randn(batch, kind.size(tiny), dtype=torch.float64)
    more = {"vjp": [d_out], "jvp": [vertices], "hvp": [d_out, vertices], "value_and_vjp": [d_out]}.get(verb, [])
    arguments = (vertices, normal, height, *more, tiny.template._key, kind.quantity, list(kind.options))
    torch.library.opcheck(getattr(torch.ops.ipman_rs, verb).default, arguments)


def test_autocast_computes_in_single_precision(kind, tiny):
    """float32 stays as it is; half goes through float32 and comes back."""
    vertices = tiny.vertices.float()
    plain = kind(vertices, tiny)
    with torch.autocast("cpu", torch.bfloat16):
        assert torch.equal(kind(vertices, tiny), plain)
        half = vertices.bfloat16()
        assert torch.equal(kind(half, tiny), kind(half.float(), tiny).bfloat16())
    with torch.autocast("cpu", torch.bfloat16), ipt.dispatch._reference_path():
        torch.testing.assert_close(kind(vertices, tiny), plain, rtol=1e-4, atol=1e-4 * plain.abs().max().item())


@pytest.mark.parametrize("dtype", [torch.float64, torch.float32, torch.bfloat16, torch.float16])
def test_dtype_of_values_and_gradients(kind, tiny, dtype):
    vertices = tiny.vertices.clone().to(dtype).requires_grad_()
    value = kind(vertices, tiny)
    assert value.dtype == dtype
    value.float().nan_to_num(posinf=0, neginf=0).sum().backward()
    assert vertices.grad.dtype == dtype
    assert vertices.grad.isfinite().all()


def test_outputs_share_no_memory_with_inputs(kind, tiny):
    vertices = tiny.vertices.clone().requires_grad_()
    value = kind(vertices, tiny)
    d_out = torch.ones_like(value)
    (gradient,) = torch.autograd.grad(value, vertices, d_out)
    places = [tensor.untyped_storage().data_ptr() for tensor in (vertices, value, d_out, gradient)]
    assert len(set(places)) == len(places)


def test_strange_memory(kind, tiny):
    """Non-contiguous vertices, a zero-stride upstream gradient, a negated view."""
    expected, slope = kind(tiny.vertices, tiny), gradient_of(lambda v: kind(v, tiny), tiny.vertices)
    strided = tiny.vertices.transpose(0, 2).contiguous().transpose(0, 2)
    assert not strided.is_contiguous()
    assert torch.equal(kind(strided, tiny), expected)
    assert torch.equal(gradient_of(lambda v: kind(v, tiny), strided), slope)

    vertices = tiny.vertices.clone().requires_grad_()
    (ones,) = torch.autograd.grad(kind(vertices, tiny), vertices, torch.ones_like(expected))
    (zero_stride,) = torch.autograd.grad(kind(vertices, tiny).sum(), vertices)
    assert torch.equal(ones, zero_stride)

    negated = torch.conj(torch.complex(torch.zeros_like(tiny.vertices), -tiny.vertices)).imag
    assert negated.is_neg()
    assert torch.equal(kind(negated, tiny), expected)


def test_a_template_lives_until_the_backward(tiny):
    template = ip.BodyTemplate(tiny.template.vertices, tiny.template.faces, num_samples=20)
    vertices = tiny.vertices.clone().requires_grad_()
    loss = ipt.stability_loss(vertices, template, tiny.ground).sum()
    del template
    gc.collect()
    loss.backward()
    assert vertices.grad.norm() > 0


class Losses(torch.utils.data.Dataset):
    """Computes in the worker."""

    def __init__(self, body):
        self.body = body

    def __len__(self):
        return 6

    def __getitem__(self, index):
        vertices = self.body.vertices.clone().requires_grad_()
        loss = ipt.IntuitivePhysicsLoss(self.body.template).weighted(vertices, self.body.ground)[0]
        loss.backward()
        return vertices.grad


def test_dataloader_workers_forked_after_use(tiny):
    """A thread pool that was started before the fork must not be waited for in the child."""
    dataset = Losses(tiny)
    expected = dataset[0]
    many = tiny.vertices.repeat(40, 1, 1)
    ipt.stability_loss(many, tiny.template, tiny.ground)
    loader = torch.utils.data.DataLoader(dataset, num_workers=2, multiprocessing_context="fork", timeout=60)
    for batch in loader:
        assert torch.equal(batch[0], expected)


@pytest.mark.slow
@pytest.mark.parametrize("forced", [False, True])
def test_compiled_code_tells_templates_apart(tiny, forced):
    """The template is a constant of the graph: another one of the same size must not run through the first one's."""
    old = tiny.template
    templates = [ip.BodyTemplate(old.vertices, old.faces, old.face_parts, num_samples=50, seed=s) for s in range(3)]

    def f(v, template):
        return ipt.center_of_pressure(v, template, tiny.ground)

    with ipt.dispatch._reference_path() if forced else pytest.MonkeyPatch.context():
        compiled = torch.compile(f, fullgraph=True, backend="aot_eager")
        for template in [*templates, *templates]:
            assert torch.equal(compiled(tiny.vertices, template), f(tiny.vertices, template))
