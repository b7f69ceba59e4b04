"""Terms that look at the whole mesh: contact, height and mass, physics, and the switch that leaves a jump alone."""

from __future__ import annotations

import functools
import math
from dataclasses import replace

import numpy as np
import pytest
import torch
import trimesh

import ipman_rs as ip
import ipman_rs.torch as ipt
from ipman_rs.body import joints, poses
from ipman_rs.fitting import static_gate
from ipman_rs.fitting.geodesics import Geodesics, geodesics
from ipman_rs.fitting.terms import physics
from ipman_rs.fitting.terms.measured_shape import CAP, MeasuredShape, exponential
from ipman_rs.fitting.terms.physics import BalanceTerm, GroundTerm, StabilityTerm
from ipman_rs.fitting.terms.presented_contact import PresentedContact
from tests.helpers import fit_terms_cases as cases


def hands_and_thighs() -> torch.Tensor:
    """A few vertices at each wrist and hip."""
    rest = cases.body_model()()
    picked = []
    for joint in ("left_wrist", "right_wrist", "left_hip"):
        away = torch.linalg.vector_norm(rest.vertices - rest.joints[joints.SMPL.index(joint)], dim=-1)
        picked.append(away.argsort()[:6])
    return torch.cat(picked)


def contact_problem(batch: int = 2, dtype: torch.dtype = torch.float64):
    return cases.problem(batch, dtype, presented=cases.presented(1, dtype, hands_and_thighs()))


def test_contact_against_all_vertices():
    problem = contact_problem(3)
    body = cases.candidate(problem, **cases.variables(3))
    template = problem.body.template
    contact = np.unique(hands_and_thighs().numpy())
    far = geodesics(template, 0.3).rows(contact)
    for row, actual in zip(body.vertices.numpy(), PresentedContact(problem).cost(body).tolist(), strict=True):
        distances = np.linalg.norm(row[contact][:, None] - row, axis=-1)
        nearest = np.where(far, distances, np.inf).min(axis=1)
        assert actual == pytest.approx(np.tanh(nearest).mean(), rel=1e-13)


def test_geodesics_are_shortest_paths():
    """Along a strip of unit squares with their diagonals."""
    mesh = trimesh.creation.box(extents=(1.0, 0.2, 0.2))
    template = ip.BodyTemplate(mesh.vertices, mesh.faces)
    corners = np.arange(len(mesh.vertices))
    x = template.vertices[:, 0]
    expected = np.abs(x[:, None] - x) > 0.5
    found = Geodesics(template, 0.5)
    assert np.array_equal(found.far(corners, corners[::-1]), expected[corners, corners[::-1]])
    assert np.array_equal(found.rows(corners[::-1]), expected[::-1])
    assert not Geodesics(template, 3.0).rows(corners).any()


def test_touching_surfaces_cost_nothing_and_have_no_nan():
    problem = contact_problem(1)
    term = PresentedContact(problem)
    vertices = torch.zeros(1, problem.body.template.num_vertices, 3, dtype=torch.float64, requires_grad=True)
    body = cases.candidate(problem, **cases.zeros(1))
    body.__dict__["posed"] = ipt.body.BodyOutput(vertices, vertices)
    cost = term.cost(body)
    (gradient,) = torch.autograd.grad(cost.sum(), vertices)
    assert cost.item() == 0
    assert gradient.count_nonzero() == 0


def test_contact_gradients():
    problem = contact_problem(2)
    term = PresentedContact(problem)
    values = cases.variables(2)

    def cost(pose, betas):
        return term.cost(cases.candidate(problem, pose=pose, betas=betas))

    inputs = tuple(values[name].requires_grad_() for name in ("pose", "betas"))
    assert torch.autograd.gradcheck(cost, inputs, fast_mode=True)


@pytest.mark.parametrize("dtype", [torch.float32, torch.float64])
def test_contact_rows_are_alone(dtype):
    cases.assert_rows_are_alone(PresentedContact, contact_problem(5, dtype), cases.variables(5, dtype))


def test_contact_that_cannot_be_is_refused():
    with pytest.raises(ValueError, match="expected indices of vertices, 0 to"):
        PresentedContact(cases.problem(presented=cases.presented(contact=torch.tensor([0, 100_000]))))
    with pytest.raises(ValueError, match=r"expected indices \(n,\) of vertices, .* float64 of shape \(2,\)"):
        PresentedContact(cases.problem(presented=cases.presented(contact=torch.zeros(2).double())))


@pytest.mark.parametrize("contact", [None, torch.zeros(0, dtype=torch.int64), torch.zeros(3, 1229, dtype=torch.bool)])
def test_no_contact_costs_nothing(contact):
    """Upstream leaves the term out: `if len(presented_contact) > 0`."""
    problem = cases.problem(3, presented=cases.presented(3, contact=contact))
    cost = PresentedContact(problem).cost(cases.candidate(problem, **cases.variables(3)))
    assert torch.equal(cost, torch.zeros(3, dtype=torch.float64))


def test_contact_of_each_body_s_own():
    """A mask a body and vertex is the lists of each body by itself, in a batch and after it was picked from one."""
    every, values = hands_and_thighs(), cases.variables(3)
    lists = [every[:6], every[3:14], every[:0]]
    masks = torch.zeros(3, 1229, dtype=torch.bool)
    for row, contact in enumerate(lists):
        masks[row, contact] = True
    problem = cases.problem(3, presented=cases.presented(3, contact=masks))
    together = PresentedContact(problem).cost(cases.candidate(problem, **values))
    for row, contact in enumerate(lists):
        alone = cases.problem(1, presented=cases.presented(1, contact=contact))
        body = {name: value[row : row + 1] for name, value in values.items()}
        assert torch.equal(PresentedContact(alone).cost(cases.candidate(alone, **body))[0], together[row])
    assert torch.equal(problem.rows(torch.tensor([1])).presented.contact, masks[1:2])


def measured(batch: int, dtype: torch.dtype = torch.float64):
    """Known height and mass of each body, 1 to 3 cm and kg off the mean body's."""
    off = torch.arange(1, batch + 1, dtype=dtype)
    return cases.problem(batch, dtype, height=mean_height() + 0.01 * off, mass=mean_mass() - off)


def mean_height() -> float:
    return np.ptp(cases.body_model().body().vertices[:, 1]).item()


def mean_mass() -> float:
    body = cases.body_model().body
    return 985.0 * trimesh.Trimesh(body().vertices, body.faces, process=False).volume


def test_measured_shape_by_hand():
    problem = measured(3)
    cost = MeasuredShape(problem).cost(cases.candidate(problem, **cases.zeros(3)))
    expected = [math.expm1(k) + math.expm1(k) for k in (1, 2, 3)]
    # the core's closed parts against trimesh's solid: their volumes agree to 1e-12
    torch.testing.assert_close(cost, torch.tensor(expected, dtype=torch.float64), rtol=1e-9, atol=0)
    betas = torch.zeros(3, 10, dtype=torch.float64)
    betas[:, 0] = 0.5
    height_alone = cases.problem(3, height=problem.height)
    body = problem.body.body(betas=betas.numpy()).vertices
    off = np.abs(np.ptp(body[..., 1], axis=-1) - problem.height.numpy())
    cost = MeasuredShape(height_alone).cost(cases.candidate(height_alone, betas=betas))
    np.testing.assert_allclose(cost, 0.0625 + np.expm1(np.minimum(100 * off, CAP)), rtol=1e-11)


def test_exponential_goes_on_as_a_line():
    x = torch.tensor([0.0, 1.0, CAP, CAP + 1, 1e6], dtype=torch.float64, requires_grad=True)
    y = exponential(x)
    edge = math.exp(CAP)
    expected = [0.0, math.expm1(1), edge - 1, 2 * edge - 1, edge * (1e6 - CAP + 1) - 1]
    torch.testing.assert_close(y.detach(), torch.tensor(expected, dtype=torch.float64), rtol=1e-14, atol=0)
    assert exponential(torch.tensor([1e30])).isfinite().all()
    steps = torch.tensor([CAP - 1e-9, CAP + 1e-9], dtype=torch.float64, requires_grad=True)
    (slopes,) = torch.autograd.grad(exponential(steps).sum(), steps)
    torch.testing.assert_close(slopes, torch.full_like(slopes, edge), rtol=1e-8, atol=0)


def test_measured_shape_gradients():
    problem = measured(2)
    term = MeasuredShape(problem)
    betas = cases.variables(2, scale=0.2)["betas"].requires_grad_()
    assert torch.autograd.gradcheck(lambda betas: term.cost(cases.candidate(problem, betas=betas)), (betas,))
    _, gradients = cases.cost_and_gradient(term, cases.zeros(2))
    assert gradients["betas"].isfinite().all()


@pytest.mark.parametrize("dtype", [torch.float32, torch.float64])
def test_measured_shape_rows_are_alone(dtype):
    cases.assert_rows_are_alone(MeasuredShape, measured(5, dtype), cases.variables(5, dtype))


def test_measured_shape_without_measures_is_refused():
    with pytest.raises(ValueError, match="measured_shape: expected a height or a mass"):
        MeasuredShape(cases.problem())


def standing(names: tuple[str, ...], dtype: torch.dtype = torch.float64, lift: float = 0.0) -> dict[str, torch.Tensor]:
    """Variables of named poses with their lowest vertex `lift` above the floor."""
    pose = torch.stack([torch.from_numpy(poses.pose(name)) for name in names]).to(dtype)
    values = cases.zeros(len(names), dtype)
    values |= {"orient": pose[:, 0], "pose": pose[:, 1:]}
    lowest = cases.body_model(dtype)(pose).vertices[..., 1].amin(dim=1)
    values["transl"] = torch.stack([torch.zeros_like(lowest), lift - lowest, torch.zeros_like(lowest)], dim=1)
    return values


SATURATED = functools.partial(BalanceTerm, wrap="saturate")
PHYSICS = {"stability": StabilityTerm, "ground": GroundTerm, "balance": BalanceTerm, "saturated": SATURATED}


def test_physics_is_the_cores():
    problem = cases.problem(3)
    values = standing(("standing", "tree", "chair"))
    body = cases.candidate(problem, **values)
    template, floor = problem.body.template, problem.ground
    stability = ipt.stability_loss(body.vertices, template, floor, alpha=70.0)
    pull, push = ipt.ground_loss(body.vertices, template, floor)
    torch.testing.assert_close(StabilityTerm(problem).cost(body), stability, rtol=1e-12, atol=0)
    torch.testing.assert_close(GroundTerm(problem).cost(body), pull + push, rtol=1e-12, atol=0)
    torch.testing.assert_close(GroundTerm(problem, pull=0.3).cost(body), 0.3 * pull + push, rtol=1e-12, atol=0)
    balance = ipt.balance_cost(body.vertices, template, floor)
    torch.testing.assert_close(BalanceTerm(problem).cost(body), balance, rtol=1e-9, atol=1e-12)
    saturated = -torch.expm1(-balance)  # J / (1 + J) of log(1 + J)
    torch.testing.assert_close(SATURATED(problem).cost(body), saturated, rtol=1e-9, atol=1e-12)


def test_terms_of_one_preset_share_an_evaluation(monkeypatch):
    calls = []
    forward = ipt.IntuitivePhysicsLoss.forward
    monkeypatch.setattr(
        ipt.IntuitivePhysicsLoss, "forward", lambda self, *given: calls.append(self) or forward(self, *given)
    )
    problem = cases.problem(1)
    stability, ground = StabilityTerm(problem), GroundTerm(problem)
    for count in (1, 2):
        body = cases.candidate(problem, **standing(("tree",)))
        stability.cost(body), ground.cost(body)
        assert len(calls) == count
    GroundTerm(problem, samples=2000).cost(body)
    assert len(calls) == 3
    assert calls[-1].template.num_samples == 2000


@pytest.mark.parametrize("name", PHYSICS)
def test_physics_gradients(name):
    problem = cases.problem(1)
    term = PHYSICS[name](problem, samples=2000)
    values = standing(("tree",), lift=-0.01)

    def cost(orient, pose, betas, transl):
        return term.cost(cases.candidate(problem, orient=orient, pose=pose, betas=betas, transl=transl))

    inputs = tuple(values[name].requires_grad_() for name in ("orient", "pose", "betas", "transl"))
    assert torch.autograd.gradcheck(cost, inputs, fast_mode=True)


@pytest.mark.parametrize("dtype", [torch.float32, torch.float64])
@pytest.mark.parametrize("name", PHYSICS)
def test_physics_rows_are_alone(name, dtype):
    values = standing(("standing", "tree", "chair", "push_up", "lunge"), dtype, lift=-0.01)
    values["orient"] = values["orient"] + 0.05 * cases.variables(5, dtype)["orient"]
    for only_static in (False, True):
        cases.assert_rows_are_alone(
            lambda problem, only_static=only_static: PHYSICS[name](problem, samples=2000, only_static=only_static),
            cases.problem(5, dtype),
            values,
        )


def test_wrong_presets_are_refused():
    with pytest.raises(ValueError, match="preset: 'balanced' has balance, pull, push, but no stability"):
        StabilityTerm(cases.problem(), preset="balanced")
    with pytest.raises(ValueError, match="preset: 'paper-r' has .* but no balance"):
        BalanceTerm(cases.problem(), preset="paper-r")


def test_switch_leaves_jumping_and_tipping_bodies_alone():
    body = cases.body_model()
    template, floor = body.template, ipt.Ground.y_up()

    def vertices(values):
        return cases.candidate(cases.problem(1), **values).vertices

    stands, hovers, jumps, sinks = (
        vertices(standing(("standing",), lift=lift)) for lift in (0.0, 0.09, 0.11, -0.4)
    )  # fmt: skip
    tips = standing(("standing",))
    tips["orient"][0, 0] = 0.6  # forward from the pelvis: the centre of mass far before the toes
    low = cases.candidate(cases.problem(1), **tips).vertices[..., 1].amin()
    tips["transl"][0, 1] -= low
    broken = stands.clone()
    broken[0, 5, 1] = torch.nan
    leans = vertices(standing(("lean_past_toes",)))
    batch = torch.cat([stands, hovers, jumps, sinks, vertices(tips), broken, leans])
    gates = static_gate.static_mask(batch, template, floor)
    margins = ipt.support_margin(batch[[0, 4, 6]], template, floor)
    assert margins[0] > 0 > margins[2] > -static_gate.LEAN > margins[1]
    assert gates.tolist() == [True, True, False, True, False, False, True]
    assert gates.dtype == torch.bool
    alone = torch.cat([static_gate.static_mask(one[None], template, floor) for one in batch])
    assert torch.equal(alone, gates)


def test_only_static_holds_from_the_start_of_a_stage():
    problem = cases.problem(2)
    on_floor, in_air = standing(("standing",)), standing(("standing",), lift=0.5)
    start = cases.candidate(problem, **{name: torch.cat([on_floor[name], in_air[name]]) for name in on_floor})
    landed = cases.candidate(problem, **{name: torch.cat([on_floor[name]] * 2) for name in on_floor})
    gated = replace(problem, static=static_gate.static_mask(start.vertices, problem.body.template, problem.ground))
    always, static = GroundTerm(problem), GroundTerm(gated, only_static=True)
    for body in (start, landed):
        assert torch.equal(static.cost(body)[0], always.cost(body)[0])
        assert static.cost(body)[1] == 0


def test_the_models_of_one_body_are_made_once():
    assert physics._loss(cases.body_model().body, "paper-o", 500) is physics._loss(
        cases.body_model().body, "paper-o", 500
    )
