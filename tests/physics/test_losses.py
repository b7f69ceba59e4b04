"""The losses and the balance cost against their formulas in plain numpy, scipy's optimiser and closed forms."""

from __future__ import annotations

import numpy as np
import pytest
import scipy.optimize
import scipy.special

import ipman_rs as ip
from tests.helpers import oracles, solids

TILT, HEIGHT = np.array([0.3, 1.0, 0.1]) / np.linalg.norm([0.3, 1.0, 0.1]), 0.02


@pytest.mark.parametrize("method", solids.METHODS)
@pytest.mark.parametrize(("alpha", "gamma", "epsilon"), [(100.0, 10.0, 0.0), (70.0, 10.0, 1e-6), (100.0, 40.0, 5.0)])
def test_stability(method, alpha, gamma, epsilon, blob, bodies):
    got = ip.stability_loss(bodies, blob, ip.Ground(TILT, HEIGHT), alpha, gamma, epsilon, method)
    for vertices, loss in zip(bodies, got, strict=True):
        points = oracles.samples(vertices, blob)
        h = oracles.heights(points, TILT, HEIGHT)
        centre = oracles.center_of_mass(vertices, blob, method)
        apart = oracles.on_ground(centre, TILT, HEIGHT) - oracles.on_ground(
            oracles.center_of_pressure(points, h, alpha, gamma, epsilon), TILT, HEIGHT
        )
        assert loss == pytest.approx(np.linalg.norm(apart), abs=1e-12)


@pytest.mark.slow
def test_stability_of_people(anny, random_people):
    people = random_people(anny, 3, seed=6)
    got = ip.stability_loss(people, anny.template, ip.Ground())
    for vertices, loss in zip(people, got, strict=True):
        points = oracles.samples(vertices, anny.template)
        apart = oracles.center_of_mass(vertices, anny.template, "pcom") - oracles.center_of_pressure(
            points, points[:, 1], 100.0, 10.0
        )
        assert loss == pytest.approx(np.hypot(apart[0], apart[2]), abs=1e-11)


def test_stability_vanishes_where_the_centres_meet():
    """Flat pressure (α = γ = 0) puts the centre of pressure into the mean of the samples: exactly 0, not NaN."""
    template = solids.plate()
    loss = ip.stability_loss(template.vertices, template, ip.Ground(), 0.0, 0.0, method="sample_mean")
    assert loss == pytest.approx(0.0, abs=1e-16)


def test_a_symmetric_body_is_in_balance():
    """A cube with very many samples: the sampling error of the two centres falls as 1/√S."""
    vertices, faces = solids.box((0.4, 0.4, 0.4))
    losses = []
    for samples in (1_000, 1_000_000):
        template = ip.BodyTemplate(vertices, faces, num_samples=samples)
        losses.append(ip.stability_loss(vertices, template, ip.Ground()))
    assert losses[1] < 1e-3
    assert losses[1] < losses[0] / 5


@pytest.mark.parametrize("points", ["samples", "vertices"])
@pytest.mark.parametrize("curve", ["tanh_squared", "tanh_of_square"])
@pytest.mark.parametrize("options", [(1.0, 0.15, 10.0, 0.15), (1.0, 0.5, 1.0, 0.15), (0.3, 0.02, 2.0, 3.0)])
def test_ground(points, curve, options, blob, bodies):
    pull, push = ip.ground_loss(bodies, blob, ip.Ground(TILT, HEIGHT), *options, points=points, curve=curve)
    for index, vertices in enumerate(bodies):
        positions = oracles.samples(vertices, blob) if points == "samples" else vertices
        expected = oracles.ground_loss(oracles.heights(positions, TILT, HEIGHT), *options, curve)
        np.testing.assert_allclose([pull[index], push[index]], expected, rtol=1e-12, atol=1e-15)


@pytest.mark.parametrize("dtype", [np.float32, np.float64])
def test_ground_saturates(dtype, blob):
    """100 m up the pull is α1 and the push 0; 100 m down the other way round."""
    up, down = ((blob.vertices + [0.0, lift, 0.0]).astype(dtype) for lift in (100.0, -100.0))
    for points in ("samples", "vertices"):
        for curve in ("tanh_squared", "tanh_of_square"):
            assert ip.ground_loss(up, blob, ip.Ground(), points=points, curve=curve) == pytest.approx((1.0, 0.0))
            assert ip.ground_loss(down, blob, ip.Ground(), points=points, curve=curve) == pytest.approx((0.0, 10.0))


def balance_problem(vertices, template, normal, height, alpha, gamma, method="pcom"):
    """p, the supports x relative to the centre of mass on the ground."""
    points = oracles.samples(vertices, template)
    frame = oracles.frame(normal)
    p = oracles.pressure(oracles.heights(points, normal, height), alpha, gamma)
    centre = oracles.center_of_mass(vertices, template, method)
    return p / p.sum(), (points - centre) @ frame.T


def dual_by_scipy(p, arms, sigma):
    """max_λ −log Σ p e^(λ·(x−m)) − ½σ²|λ|², by scipy's trust region with its own derivatives."""

    def minus(lam):
        exponent = arms @ lam
        weight = scipy.special.softmax(exponent + np.log(p))
        value = scipy.special.logsumexp(exponent, b=p) + sigma**2 / 2 * lam @ lam
        mean = weight @ arms
        hessian = (arms * weight[:, None]).T @ arms - np.outer(mean, mean) + sigma**2 * np.eye(2)
        return value, mean + sigma**2 * lam, hessian

    found = scipy.optimize.minimize(
        lambda lam: minus(lam)[:2], np.zeros(2), jac=True, hess=lambda lam: minus(lam)[2], method="trust-exact",
        options={"gtol": 1e-12, "maxiter": 1000},
    )  # fmt: skip
    return -found.fun


@pytest.mark.parametrize("method", ["pcom", "exact"])
@pytest.mark.parametrize(("gamma", "sigma"), [(50.0, 0.02), (10.0, 0.1)])
def test_balance_cost_against_scipy(method, gamma, sigma, blob, bodies):
    ground = ip.Ground(TILT, HEIGHT)
    got = {
        wrap: ip.balance_cost(bodies, blob, ground, 100.0, gamma, sigma, wrap, method)
        for wrap in ("none", "log", "saturate")
    }
    for index, vertices in enumerate(bodies):
        p, arms = balance_problem(vertices, blob, TILT, HEIGHT, 100.0, gamma, method)
        expected = dual_by_scipy(p, arms, sigma)
        # scipy stops at a gradient of 1e-12; the optimum is flat there, so the value is right to far below 1e-9.
        assert got["none"][index] == pytest.approx(expected, rel=1e-9, abs=1e-12)
        assert got["log"][index] == pytest.approx(np.log1p(expected), rel=1e-9, abs=1e-12)
        assert got["saturate"][index] == pytest.approx(expected / (1 + expected), rel=1e-9, abs=1e-12)


@pytest.mark.parametrize("pose", ["standing", "one_leg", "lean_past_toes", "plank", "all_fours"])
def test_balance_cost_of_named_poses(pose, lite):
    vertices = ip.body.posed(lite, pose)
    p, arms = balance_problem(vertices, lite.template, [0.0, 1.0, 0.0], 0.0, 100.0, 50.0)
    got = ip.balance_cost(vertices, lite.template, ip.Ground(), wrap="none")
    assert got == pytest.approx(dual_by_scipy(p, arms, 0.02), rel=1e-8)


def test_the_dual_value_is_a_primal_divergence(blob, bodies):
    """With hardly any blur J is the smallest KL(w‖p) over w ≥ 0, Σw = 1, Σ w x = m: solved in w itself, by SLSQP."""
    template = ip.BodyTemplate(blob.vertices, blob.faces, blob.face_parts, num_samples=40, seed=1)
    p, arms = balance_problem(bodies[2], template, [0.0, 1.0, 0.0], 0.0, 1.0, 3.0)
    found = scipy.optimize.minimize(
        lambda w: (w * np.log(w / p)).sum(), p, jac=lambda w: np.log(w / p) + 1, bounds=[(1e-15, 1)] * 40,
        constraints=[{"type": "eq", "fun": lambda w: w.sum() - 1, "jac": lambda w: np.ones(40)},
                     {"type": "eq", "fun": lambda w: w @ arms, "jac": lambda w: arms.T}],
        method="SLSQP", options={"ftol": 1e-14, "maxiter": 500},
    )  # fmt: skip
    assert found.success
    got = ip.balance_cost(bodies[2], template, ip.Ground(), 1.0, 3.0, sigma=1e-6, wrap="none")
    assert got == pytest.approx(found.fun, rel=1e-6)  # SLSQP's own convergence


def test_balance_cost_near_balance_is_half_a_mahalanobis_distance(blob):
    """J ≈ ½ dᵀ(Σ_p + σ²I)⁻¹ d with d = m − s̄ on the ground; its error is of third order in d."""
    alpha, gamma, sigma, ground = 1.0, 0.05, 0.02, [0.0, 1.0, 0.0]
    p, arms = balance_problem(blob.vertices, blob, ground, 0.0, alpha, gamma, "sample_mean")
    d = -(p @ arms)
    spread = (arms * p[:, None]).T @ arms - np.outer(d, d) + sigma**2 * np.eye(2)
    expected = d @ np.linalg.solve(spread, d) / 2
    got = ip.balance_cost(blob.vertices, blob, ip.Ground(), alpha, gamma, sigma, "none", "sample_mean")
    assert expected < 1e-2
    assert got == pytest.approx(expected, rel=0.1)
    assert got > 0


def test_balance_cost_of_falling_bodies(blob):
    """All but the feet moved 3 m aside: J is large but finite, and is still scipy's."""
    far = blob.vertices.copy()
    far[blob.vertices[:, 1] > 0.3, 0] += 3.0
    p, arms = balance_problem(far, blob, [0.0, 1.0, 0.0], 0.0, 100.0, 50.0)
    cost = ip.balance_cost(far, blob, ip.Ground(), wrap="none")
    assert cost > 10
    assert cost == pytest.approx(dual_by_scipy(p, arms, 0.02), rel=1e-9)
    for lift in (100.0, -1.0):
        moved = far + [0.0, lift, 0.0]
        for wrap in ("none", "log", "saturate"):
            assert np.isfinite(ip.balance_cost(moved, blob, ip.Ground(), wrap=wrap))


@pytest.mark.parametrize("distance", [0.5, 3.0, 30.0])
@pytest.mark.parametrize("sigma", [0.02, 0.2])
def test_balance_cost_outside_all_supports(distance, sigma, blob):
    """A vertex that no face uses pulls the vertex mean out of the hull of all samples. Only the blur pays for that:
    J lies between the squared distances to the hull and to its farthest support, over 2σ²."""
    count = blob.num_vertices
    vertices = np.vstack([blob.vertices, blob.vertices.mean(axis=0)])
    template = ip.BodyTemplate(vertices, blob.faces, blob.face_parts, num_samples=300)
    vertices[-1, 0] += distance * (count + 1)
    p, arms = balance_problem(vertices, template, [0.0, 1.0, 0.0], 0.0, 100.0, 50.0, "vertex_mean")
    got = ip.balance_cost(vertices, template, ip.Ground(), 100.0, 50.0, sigma, "none", "vertex_mean")
    to_hull = -oracles.signed_margin(arms, np.zeros(2))
    assert to_hull > 0
    assert to_hull**2 / (2 * sigma**2) < got
    assert got < (np.linalg.norm(arms, axis=1).max() ** 2) / (2 * sigma**2) - np.log(p.min())
    assert got == pytest.approx(dual_by_scipy(p, arms, sigma), rel=1e-7)
    assert np.isfinite(ip.balance_cost(vertices, template, ip.Ground(), 100.0, 50.0, 1e-4, "log", "vertex_mean"))


def test_the_cost_does_not_change_when_a_balanced_body_hovers(blob):
    """Above the ground every ρ is scaled alike, so p and J stay."""
    low = ip.balance_cost(blob.vertices + [0.0, 1.0, 0.0], blob, ip.Ground(), wrap="none")
    high = ip.balance_cost(blob.vertices + [0.0, 100.0, 0.0], blob, ip.Ground(), wrap="none")
    assert high == pytest.approx(low, rel=1e-9)
