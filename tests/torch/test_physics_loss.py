"""IntuitivePhysicsLoss: reductions, weights, masks, and the fused path against the plain one."""

from __future__ import annotations

import copy
import pickle
from dataclasses import replace

import pytest
import torch

import ipman_rs.torch as ipt
from ipman_rs import presets

F64 = torch.float64
REDUCTIONS = pytest.mark.parametrize("reduction", ["mean", "sum", "none"])
PRESETS = pytest.mark.parametrize("preset", list(presets.PRESETS))


def terms_by_hand(vertices, body, preset):
    """The terms a body, from the functions."""
    p = presets.get(preset)
    pull, push = ipt.ground_loss(vertices, body.template, body.ground, p.alpha1, p.alpha2, p.beta1, p.beta2)
    if p.stability == "balance":
        first = ipt.balance_cost(vertices, body.template, body.ground, p.alpha, p.balance_gamma, p.sigma)
        return {"balance": first, "pull": pull, "push": push}
    first = ipt.stability_loss(vertices, body.template, body.ground, p.alpha, p.gamma, p.epsilon)
    return {"stability": first, "pull": pull, "push": push}


def test_a_loss_has_the_terms_that_its_preset_weighs(tiny):
    """Those of any subset of the core's list, with the numbers of the whole."""
    paper = presets.get("paper-r")
    whole = ipt.IntuitivePhysicsLoss(tiny.template, paper)(tiny.vertices, tiny.ground)
    for weights in ({"stability": 1.0}, {"pull": 1.0, "push": 2.0}, {"balance": 1.0, "stability": 1.0}):
        loss = ipt.IntuitivePhysicsLoss(tiny.template, replace(paper, weights=weights))
        assert loss.terms == tuple(sorted(weights, key=("stability", "balance", "pull", "push").index))
        leaf = tiny.vertices.clone().requires_grad_()
        terms = loss(leaf, tiny.ground)
        for name in set(terms) & set(whole):
            torch.testing.assert_close(terms[name].detach(), whole[name], rtol=1e-14, atol=0)
        (slope,) = torch.autograd.grad(sum(terms.values()), leaf)
        with ipt.dispatch._reference_path():
            (expected,) = torch.autograd.grad(sum(loss(leaf, tiny.ground).values()), leaf)
        # Sums in another order in double precision; the balance cost's inner solve ends at 1e-12 of a metre.
        torch.testing.assert_close(slope, expected, rtol=0, atol=1e-10 * expected.abs().max().item())
    for weights in ({}, {"pull": 1.0}, {"stability": 1.0, "comfort": 1.0}):
        with pytest.raises(ValueError, match="weights of preset 'paper-r': expected stability, balance, pull and push"):
            ipt.IntuitivePhysicsLoss(tiny.template, replace(paper, weights=weights))
    with pytest.raises(ValueError, match="alpha2"):
        ipt.IntuitivePhysicsLoss(tiny.template, replace(paper, alpha2=-1.0))


@PRESETS
def test_presets_name_the_term_that_they_weigh(preset):
    numbers = presets.get(preset)
    assert (numbers.stability == "balance") == ("balance" in numbers.weights) != ("stability" in numbers.weights)


def reduce(values, valid, reduction):
    if reduction == "none":
        return torch.where(valid, values, 0)
    total = values[valid].sum()
    return total / max(int(valid.sum()), 1) if reduction == "mean" else total


@PRESETS
@REDUCTIONS
@pytest.mark.parametrize("forced", [False, True])
@pytest.mark.parametrize("mask", [None, [True, False, True], [False, False, False]])
def test_values_and_gradients(tiny, preset, reduction, forced, mask):
    valid = None if mask is None else torch.tensor(mask)
    counted = torch.ones(3, dtype=torch.bool) if valid is None else valid
    loss = ipt.IntuitivePhysicsLoss(tiny.template, preset, reduction)
    by_hand = tiny.vertices.clone().requires_grad_()
    expected = {name: reduce(term, counted, reduction) for name, term in terms_by_hand(by_hand, tiny, preset).items()}
    total = sum(loss.weights[name] * term for name, term in expected.items())
    upstream = torch.arange(1.0, 4.0, dtype=F64) if reduction == "none" else torch.tensor(2.5, dtype=F64)
    (slope,) = torch.autograd.grad(total, by_hand, upstream)
    assert loss.weights == presets.get(preset).weights

    with ipt.dispatch._reference_path() if forced else pytest.MonkeyPatch.context():
        fused = tiny.vertices.clone().requires_grad_()
        ours, terms = loss.weighted(fused, tiny.ground, valid)
        assert ours.requires_grad
        ours.backward(upstream)
        separate = tiny.vertices.clone().requires_grad_()
        unweighted = loss(separate, tiny.ground, valid)
        sum(loss.weights[name] * term for name, term in unweighted.items()).backward(upstream)

    close = {"rtol": 1e-10, "atol": 1e-14}
    torch.testing.assert_close(ours, total, **close)
    assert list(terms) == list(unweighted) == list(expected)
    for name in terms:
        assert not terms[name].requires_grad
        torch.testing.assert_close(terms[name], expected[name], **close)
        torch.testing.assert_close(unweighted[name], expected[name], **close)
    scale = slope.abs().max().item()
    torch.testing.assert_close(fused.grad, slope, rtol=0, atol=1e-10 * scale)
    torch.testing.assert_close(separate.grad, slope, rtol=0, atol=1e-10 * scale)


@REDUCTIONS
@pytest.mark.parametrize("forced", [False, True])
def test_a_broken_body_counts_as_invalid(tiny, reduction, forced):
    """As if it were not in the batch: the mean runs over the rest, its gradient is zero."""
    loss = ipt.IntuitivePhysicsLoss(tiny.template, reduction=reduction)
    broken = tiny.vertices.clone()
    broken[1, 0, 0] = torch.nan
    valid = torch.tensor([True, False, True])
    with ipt.dispatch._reference_path() if forced else pytest.MonkeyPatch.context():
        for mask in (None, torch.tensor([True, True, True])):
            vertices, sound = broken.clone().requires_grad_(), tiny.vertices.clone().requires_grad_()
            ours, terms = loss.weighted(vertices, tiny.ground, mask)
            expected, expected_terms = loss.weighted(sound, tiny.ground, valid)
            ours.sum().backward()
            expected.sum().backward()
            torch.testing.assert_close(ours, expected, rtol=1e-14, atol=0)
            torch.testing.assert_close(terms, expected_terms, rtol=1e-14, atol=0)
            torch.testing.assert_close(vertices.grad, sound.grad, rtol=1e-13, atol=1e-18)
            vertices = broken.clone().requires_grad_()
            forward = loss(vertices, tiny.ground, mask)
            sum(term.sum() for term in forward.values()).backward()
            assert (vertices.grad[1] == 0).all()
            torch.testing.assert_close({k: v.detach() for k, v in forward.items()}, expected_terms, rtol=1e-14, atol=0)


@REDUCTIONS
def test_nothing_valid_gives_zero_with_a_graph(tiny, reduction):
    loss = ipt.IntuitivePhysicsLoss(tiny.template, reduction=reduction)
    for vertices, valid in (
        (tiny.vertices, torch.zeros(3, dtype=torch.bool)),
        (torch.full_like(tiny.vertices, torch.nan), None),
        (tiny.vertices[:0], None),
    ):
        vertices = vertices.clone().requires_grad_()
        total, terms = loss.weighted(vertices, tiny.ground, valid)
        assert (total == 0).all()
        assert all((term == 0).all() for term in terms.values())
        total.sum().backward()
        assert (vertices.grad == 0).all()
        separate = loss(vertices, tiny.ground, valid)
        assert all((term == 0).all() and term.requires_grad for term in separate.values())


def test_without_grad_only_values_are_computed(tiny):
    loss = ipt.IntuitivePhysicsLoss(tiny.template)
    with torch.no_grad():
        total, _ = loss.weighted(tiny.vertices.clone().requires_grad_(), tiny.ground)
    assert not total.requires_grad
    expected, _ = loss.weighted(tiny.vertices.clone().requires_grad_(), tiny.ground)
    torch.testing.assert_close(total, expected.detach(), rtol=1e-14, atol=0)


def test_backward_twice_and_second_derivatives(tiny):
    """The stored gradient is given away once; a retained graph computes it again, create_graph goes the long way."""
    loss = ipt.IntuitivePhysicsLoss(tiny.template)

    def total(v):
        return loss.weighted(v, tiny.ground)[0]

    vertices = tiny.vertices.clone().requires_grad_()
    value = total(vertices)
    (first,) = torch.autograd.grad(value, vertices, torch.tensor(3.0, dtype=F64), retain_graph=True)
    (second,) = torch.autograd.grad(value, vertices, torch.tensor(3.0, dtype=F64))
    torch.testing.assert_close(first, second, rtol=1e-13, atol=1e-18)
    assert torch.autograd.gradcheck(total, (vertices,), fast_mode=True, check_forward_ad=True, check_batched_grad=True)
    assert torch.autograd.gradgradcheck(total, (vertices,), fast_mode=True)
    torch.testing.assert_close(torch.func.grad(total)(tiny.vertices), first / 3, rtol=1e-12, atol=1e-18)
    hessian = torch.func.hessian(total)(tiny.vertices[:1])
    with ipt.dispatch._reference_path():
        expected = torch.func.hessian(total)(tiny.vertices[:1])
    torch.testing.assert_close(hessian, expected, rtol=0, atol=1e-9 * expected.abs().max().item())
    mapped = torch.func.vmap(torch.func.grad(total))(tiny.vertices) / 3
    torch.testing.assert_close(mapped, first / 3, rtol=1e-12, atol=1e-18)


@pytest.mark.parametrize("preset", ["paper-r", "released", "balanced"])
@pytest.mark.parametrize("reduction", ["mean", "none"])
def test_separate_terms_take_any_upstream_twice(tiny, preset, reduction):
    """The kept Jacobian serves every backward of the graph: each against the reference with an upstream of its own."""
    loss = ipt.IntuitivePhysicsLoss(tiny.template, preset=preset, reduction=reduction)
    vertices = tiny.vertices.clone().requires_grad_()
    terms = torch.stack(list(loss(vertices, tiny.ground).values()))
    generator = torch.Generator().manual_seed(4)
    for _ in range(2):
        upstream = torch.randn(terms.shape, dtype=F64, generator=generator)
        (found,) = torch.autograd.grad(terms, vertices, upstream, retain_graph=True)
        with ipt.dispatch._reference_path():
            reference = torch.stack(list(loss(vertices, tiny.ground).values()))
        (expected,) = torch.autograd.grad(reference, vertices, upstream)
        # Sums in another order in double precision; the balance cost's inner solve ends at 1e-12 of a metre.
        torch.testing.assert_close(found, expected, rtol=0, atol=1e-10 * expected.abs().max().item())


def test_separate_terms_of_nobody(tiny):
    vertices = tiny.vertices[:0].clone().requires_grad_()
    terms = ipt.IntuitivePhysicsLoss(tiny.template)(vertices, ipt.Ground.y_up())
    sum(terms.values()).backward()
    assert vertices.grad.shape == vertices.shape


def test_inside_a_transform_of_something_else(tiny):
    """torch.func over the ground or the weight of a loss whose vertices are an ordinary leaf."""
    loss = ipt.IntuitivePhysicsLoss(tiny.template)
    vertices = tiny.vertices.clone().requires_grad_()

    def total(height):
        return loss.weighted(vertices, ipt.Ground((0.1, 1.0, 0.05), height))[0]

    heights = torch.tensor([-0.02, 0.0, 0.03], dtype=F64)
    mapped = torch.func.vmap(total)(heights)
    expected = torch.stack([total(height) for height in heights])
    torch.testing.assert_close(mapped, expected, rtol=1e-13, atol=0)
    (slope,) = torch.autograd.grad(mapped.sum(), vertices)
    (expected_slope,) = torch.autograd.grad(expected.sum(), vertices)
    torch.testing.assert_close(slope, expected_slope, rtol=1e-12, atol=1e-18)
    by_weight = torch.func.grad(lambda weight: weight * total(heights[0]))(heights[1])
    torch.testing.assert_close(by_weight, expected[0], rtol=1e-13, atol=0)


def test_the_gradient_is_handed_over_without_a_copy(tiny):
    """A leaf's .grad is the very buffer the core wrote: a copy would cost as much as the gradient."""
    loss = ipt.IntuitivePhysicsLoss(tiny.template)
    vertices = tiny.vertices.clone().requires_grad_()
    total, _ = loss.weighted(vertices, tiny.ground)
    buffer = total.grad_fn
    while not hasattr(buffer, "gradient"):
        buffer = next(f for f, _ in buffer.next_functions if f is not None)
    place = buffer.gradient.ctypes.data
    total.backward()
    assert vertices.grad.data_ptr() == place


def test_half_precision_bodies_have_float_losses(tiny):
    loss = ipt.IntuitivePhysicsLoss(tiny.template)
    vertices = tiny.vertices.bfloat16().requires_grad_()
    with torch.autocast("cpu", torch.bfloat16):
        total, terms = loss.weighted(vertices, tiny.ground)
    assert total.dtype == terms["pull"].dtype == torch.float32
    total.backward()
    assert vertices.grad.dtype == torch.bfloat16

    single = vertices.detach().float().requires_grad_()
    expected, _ = loss.weighted(single, tiny.ground)
    expected.backward()
    assert torch.equal(total, expected)
    assert torch.equal(vertices.grad, single.grad.bfloat16())


def test_options_reach_the_formula(tiny):
    loss = ipt.IntuitivePhysicsLoss(
        tiny.template, points="vertices", curve="tanh_of_square", method="exact", weights={"push": 7.0}
    )
    assert loss.weights == {**presets.get("paper-r").weights, "push": 7.0}
    terms = loss(tiny.vertices, tiny.ground)
    pull, push = ipt.ground_loss(tiny.vertices, tiny.template, tiny.ground, points="vertices", curve="tanh_of_square")
    stability = ipt.stability_loss(tiny.vertices, tiny.template, tiny.ground, method="exact")
    for ours, theirs in zip(terms.values(), (stability, pull, push), strict=True):
        torch.testing.assert_close(ours, theirs.mean(), rtol=1e-12, atol=0)
    wrapped = ipt.IntuitivePhysicsLoss(tiny.template, "balanced", wrap="saturate")(tiny.vertices, tiny.ground)[
        "balance"
    ]
    numbers = presets.get("balanced")
    expected = ipt.balance_cost(
        tiny.vertices, tiny.template, tiny.ground, numbers.alpha, numbers.balance_gamma, numbers.sigma, "saturate"
    )
    torch.testing.assert_close(wrapped, expected.mean(), rtol=1e-12, atol=0)


@pytest.mark.parametrize(
    ("options", "names"),
    [
        ({"preset": "paper"}, "preset"),
        ({"reduction": "avg"}, "reduction"),
        ({"weights": {"balance": 1.0}}, "balance"),
        ({"points": "faces"}, "points"),
        ({"curve": "x"}, "curve"),
        ({"method": "x"}, "method"),
        ({"preset": "balanced", "wrap": "x"}, "wrap"),
    ],
)
def test_unknown_options_are_named(tiny, options, names):
    with pytest.raises(ValueError, match=names):
        ipt.IntuitivePhysicsLoss(tiny.template, **options)


@pytest.mark.parametrize("valid", [torch.ones(2, dtype=torch.bool), torch.ones(3)])
def test_wrong_masks_are_named(tiny, valid):
    with pytest.raises(ValueError, match="valid"):
        ipt.IntuitivePhysicsLoss(tiny.template).weighted(tiny.vertices, tiny.ground, valid)


def test_it_is_a_plain_module(tiny):
    """Nothing to train, nothing in the state; copies and pickles give the same numbers."""
    loss = ipt.IntuitivePhysicsLoss(tiny.template)
    assert loss.state_dict() == {}
    assert list(loss.parameters()) == []
    expected = loss.weighted(tiny.vertices, tiny.ground)[0]
    for twin in (copy.deepcopy(loss), pickle.loads(pickle.dumps(loss))):
        assert torch.equal(twin.weighted(tiny.vertices, tiny.ground)[0], expected)
    assert "paper-r" in repr(loss)


@pytest.mark.slow
@PRESETS
@pytest.mark.parametrize("reduction", ["mean", "none"])
def test_compile_fullgraph(tiny, preset, reduction):
    torch.compiler.reset()
    loss = ipt.IntuitivePhysicsLoss(tiny.template, preset, reduction)
    broken = tiny.vertices.clone()
    broken[2, 3, 1] = torch.inf
    valid = torch.tensor([True, False, True])
    for vertices in (tiny.vertices, broken):
        results = []
        for method in (loss.weighted, torch.compile(loss.weighted, fullgraph=True, backend="aot_eager")):
            leaf = vertices.clone().requires_grad_()
            total, terms = method(leaf, tiny.ground, valid)
            total.sum().backward()
            results.append((total.detach(), leaf.grad, terms))
        torch.testing.assert_close(results[0], results[1], rtol=1e-12, atol=1e-16)
        terms = torch.compile(loss, fullgraph=True, backend="aot_eager")(vertices, tiny.ground, valid)
        torch.testing.assert_close(terms, results[0][2], rtol=1e-12, atol=1e-16)


class Offset(torch.nn.Module):
    """A model of three parameters with the loss inside, as trainers nest it."""

    def __init__(self, body):
        super().__init__()
        self.offset = torch.nn.Parameter(torch.zeros(3, dtype=F64))
        self.loss = ipt.IntuitivePhysicsLoss(body.template)

    def forward(self, vertices, ground):
        return self.loss.weighted(vertices + self.offset, ground)[0]


def test_distributed_data_parallel(tiny, tmp_path):
    store = torch.distributed.FileStore(str(tmp_path / "store"), 1)
    torch.distributed.init_process_group("gloo", store=store, rank=0, world_size=1)
    try:
        model = torch.nn.parallel.DistributedDataParallel(Offset(tiny))
        model(tiny.vertices, tiny.ground).backward()
        gradient = model.module.offset.grad
    finally:
        torch.distributed.destroy_process_group()
    plain = Offset(tiny)
    plain(tiny.vertices, tiny.ground).backward()
    torch.testing.assert_close(gradient, plain.offset.grad, rtol=1e-13, atol=0)
    assert gradient.norm() > 0
