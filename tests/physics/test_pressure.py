"""Pressure and the centre of pressure against the paper's formulas in plain numpy, on any ground.

Tolerances are a few roundings of double precision on heights of about a metre times α or γ: 1e-13 of the value.
"""

from __future__ import annotations

import numpy as np
import pytest

import ipman_rs as ip
from ipman_rs import quantities
from tests.helpers import oracles, solids

SLOPE = np.array([0.2, 1.0, -0.1]) / np.linalg.norm([0.2, 1.0, -0.1])


@pytest.mark.parametrize(("alpha", "gamma"), [(100.0, 10.0), (70.0, 10.0), (3.0, 50.0), (0.0, 0.0)])
def test_pressure_of_each_sample(alpha, gamma, blob, bodies):
    ground = ip.Ground(SLOPE, 0.03)
    points = ip.sample_surface(bodies, blob)
    h = oracles.heights(points, SLOPE, 0.03)
    assert (h < 0).any()
    assert (h > 0).any()
    got = ip.pressure(bodies, blob, ground, alpha, gamma)
    np.testing.assert_allclose(got, oracles.pressure(h, alpha, gamma), rtol=1e-13)


@pytest.mark.parametrize("epsilon", [0.0, 1e-6, 10.0])
def test_centre_of_pressure(epsilon, blob, bodies):
    got = ip.center_of_pressure(bodies, blob, ip.Ground(SLOPE, 0.03), 100.0, 10.0, epsilon)
    for points, centre in zip(ip.sample_surface(bodies, blob), got, strict=True):
        h = oracles.heights(points, SLOPE, 0.03)
        expected = oracles.center_of_pressure(points, h, 100.0, 10.0, epsilon)
        np.testing.assert_allclose(centre, expected, rtol=0, atol=1e-13)


def test_people_on_the_floor(anny, random_people):
    people = random_people(anny, 3, seed=5) - [0.0, 0.02, 0.0]
    ground = ip.Ground.y_up()
    got = ip.center_of_pressure(people, anny.template, ground)
    for vertices, centre in zip(people, got, strict=True):
        points = oracles.samples(vertices, anny.template)
        np.testing.assert_allclose(
            centre, oracles.center_of_pressure(points, points[:, 1], 100.0, 10.0), rtol=0, atol=1e-12
        )


@pytest.mark.parametrize("dtype", [np.float32, np.float64])
@pytest.mark.parametrize("lift", [100.0, 1e4])
def test_hovering_bodies_keep_their_centre(lift, dtype, blob):
    """Every e^(−γh) underflows, but the ratio does not depend on the height: it is that of the body on the floor."""
    vertices = (blob.vertices + [0.0, lift, 0.0]).astype(dtype)
    ground = ip.Ground.y_up()
    grounded = vertices.astype(np.float64) - [0.0, lift, 0.0]
    expected = ip.center_of_pressure(grounded, blob, ground) + [0.0, lift, 0.0]
    got = ip.center_of_pressure(vertices, blob, ground)
    assert np.isfinite(ip.pressure(vertices, blob, ground)).all()
    # A unit in the last place at that height, which single precision spends on its own coordinates.
    np.testing.assert_allclose(got, expected, rtol=0, atol=2 * np.spacing(dtype(lift)) + 1e-12)


@pytest.mark.parametrize("lift", [0.5, 1000.0])
@pytest.mark.parametrize("size", [4.0, 100.0, 300.0])
def test_a_tall_hovering_body_keeps_its_centre(size, lift, blob):
    """On its tip: the lowest of its few samples lies metres above its lowest vertex.

    Single precision rounds coordinates to 6e-8 of them, which moves an exponent by γ times as much; three roundings of
    the size and the height are allowed.
    """
    points = size * np.array([[0.0, 0, 0], [0.4, 1, 0.1], [-0.3, 1, 0.4], [-0.1, 1.1, -0.3]])
    faces = [[0, 1, 2], [0, 2, 3], [0, 3, 1], [1, 3, 2]]
    cone = ip.BodyTemplate(points, faces, num_samples=12, seed=3)
    vertices = (points + [0.0, lift, 0.0]).astype(np.float32)
    samples = ip.sample_surface(vertices.astype(np.float64), cone)
    weights = np.exp(-10.0 * (samples[:, 1] - samples[:, 1].min()))
    assert samples[:, 1].min() > lift + 0.09 * size
    expected = (weights[:, None] * samples).sum(0) / weights.sum()
    got = ip.center_of_pressure(vertices, cone, ip.Ground())
    spread = np.ptp(samples, axis=0).max()
    np.testing.assert_allclose(got, expected, rtol=0, atol=3 * 6e-8 * (size + lift) * (1 + 10.0 * spread))


@pytest.mark.parametrize("dtype", [np.float32, np.float64])
def test_epsilon_swallows_a_hovering_body(dtype, blob):
    """As released: Σρ is nothing beside 1e-6, so the centre falls back to the world's origin, not to NaN."""
    vertices = (blob.vertices + [3.0, 100.0, 0.0]).astype(dtype)
    got = ip.center_of_pressure(vertices, blob, ip.Ground.y_up(), epsilon=1e-6)
    np.testing.assert_allclose(got, 0.0, rtol=0, atol=1e-12)


@pytest.mark.parametrize("dtype", [np.float32, np.float64])
def test_sunk_bodies(dtype, blob):
    vertices = (blob.vertices - [0.0, 1.0, 0.0]).astype(dtype)
    points = oracles.samples(vertices.astype(np.float64), blob)
    got = ip.pressure(vertices, blob, ip.Ground.y_up())
    np.testing.assert_allclose(
        got, oracles.pressure(points[:, 1], 100.0, 10.0), rtol=1e-12 if dtype == np.float64 else 1e-4
    )
    assert got.max() > 50
    centre = ip.center_of_pressure(vertices, blob, ip.Ground.y_up())
    expected = oracles.center_of_pressure(points, points[:, 1], 100.0, 10.0)
    np.testing.assert_allclose(centre, expected, rtol=0, atol=1e-12 if dtype == np.float64 else 1e-6)


def test_the_branch_at_the_kink_is_the_upper_one():
    """A plate that lies on the floor: ρ = 1 on its underside, and pushing it up changes ρ by −γ, not by −α."""
    template = solids.plate()
    below = template.vertices[template.faces[template.sample_faces]][..., 1].max(axis=1) == 0.0
    assert below.any()
    assert not below.all()
    assert (ip.pressure(template.vertices, template, ip.Ground())[below] == 1.0).all()
    up = np.zeros_like(template.vertices)
    up[:, 1] = 1.0
    quantity = quantities.pressure(100.0, 10.0, template).of(template)
    slope = quantity.jvp(template.vertices[None], np.array([[0.0, 1, 0]]), np.zeros(1), up[None])
    np.testing.assert_allclose(slope[0, below], -10.0, rtol=1e-12)


def turned(vertices, ground, turn):
    """The world seen in other axes: rotation `turn` on the body and on the ground alike."""
    return vertices @ turn.T, ip.Ground(ground.normal @ turn.T, ground.height)


Z_UP = np.array([[1.0, 0.0, 0.0], [0.0, 0.0, -1.0], [0.0, 1.0, 0.0]])  # y becomes z


@pytest.mark.parametrize("name", [name for name in solids.EVERY if name != "mass_properties"])
def test_z_up_is_y_up_on_the_turned_body(name, blob, bodies):
    still = solids.EVERY[name](bodies, blob, ip.Ground.y_up(0.01))
    moved = solids.EVERY[name](bodies @ Z_UP.T, blob, ip.Ground.z_up(0.01))
    for before, after in zip(still, moved, strict=True):
        vector = before.shape[1:] in {(3,), (blob.num_samples, 3)}
        np.testing.assert_allclose(after, before @ Z_UP.T if vector else before, rtol=1e-12, atol=1e-13)


def test_z_up_and_y_up_are_the_axes():
    np.testing.assert_array_equal(ip.Ground.y_up().normal, [0, 1, 0])
    np.testing.assert_array_equal(ip.Ground.z_up(0.5).normal, [0, 0, 1])
    assert ip.Ground.z_up(0.5).height == 0.5


@pytest.mark.parametrize("seed", range(5))
def test_any_ground_is_the_floor_of_a_turned_world(seed, blob, bodies):
    rng = np.random.default_rng(seed)
    turn = np.linalg.qr(rng.normal(size=(3, 3)))[0]
    turn *= np.sign(np.linalg.det(turn))
    vertices, ground = turned(bodies, ip.Ground.y_up(-0.7), turn)
    for function in (ip.stability_loss, ip.support_margin, ip.balance_cost):
        expected = function(bodies, blob, ip.Ground.y_up(-0.7))
        # Contacts are decided by |h| < τ: no sample lies within rounding of it here.
        np.testing.assert_allclose(function(vertices, blob, ground), expected, rtol=1e-10, atol=1e-12)


@pytest.mark.parametrize("name", solids.EVERY)
def test_one_ground_a_body(name, blob, bodies, rng):
    normals, heights = rng.normal(size=(6, 3)) * 0.2 + [0, 1, 0], rng.normal(size=6) * 0.05
    together = solids.EVERY[name](bodies, blob, ip.Ground(normals, heights))
    for index in range(6):
        alone = solids.EVERY[name](bodies[index], blob, ip.Ground(normals[index], heights[index]))
        for many, one in zip(together, alone, strict=True):
            np.testing.assert_array_equal(many[index], one)


def test_normals_are_normalised(blob, bodies):
    for scale in (1e-200, 2.0, 1e200):
        ground = ip.Ground(np.array([0.0, scale, 0.0]), 0.01)
        np.testing.assert_array_equal(ground.normal, [0, 1, 0])
        np.testing.assert_array_equal(
            ip.pressure(bodies, blob, ground), ip.pressure(bodies, blob, ip.Ground.y_up(0.01))
        )


def test_heights_and_feet(rng):
    points = rng.normal(size=(7, 5, 3))
    ground = ip.Ground(rng.normal(size=(7, 3)), rng.normal(size=7))
    h = ground.signed_height(points)
    for index in range(7):
        np.testing.assert_allclose(
            h[index], oracles.heights(points[index], ground.normal[index], ground.height[index]), atol=1e-14
        )
    feet = ground.project(points)
    np.testing.assert_allclose(ground.signed_height(feet), 0.0, atol=1e-14)
    np.testing.assert_allclose(feet + h[..., None] * ground.normal[:, None], points, atol=1e-14)
    first, second = ground.axes()
    frame = np.stack([first, second, ground.normal], axis=-2)
    np.testing.assert_allclose(frame @ frame.swapaxes(-1, -2), np.broadcast_to(np.eye(3), (7, 3, 3)), atol=1e-14)
    np.testing.assert_allclose(np.linalg.det(frame), 1.0, atol=1e-14)


def test_a_sweep_over_an_option_keeps_few_quantities():
    """A template keeps the core's objects of its latest quantities, but not without end; the values do not depend on
    what is kept."""
    template = solids.plate()
    first = ip.pressure(template.vertices, template, ip.Ground(), alpha=0.0)
    for alpha in range(1, 2 * quantities.MOST_HANDLES):
        ip.pressure(template.vertices, template, ip.Ground(), alpha=alpha)
        assert 0 < len(template._quantities) <= quantities.MOST_HANDLES
    np.testing.assert_array_equal(ip.pressure(template.vertices, template, ip.Ground(), alpha=0.0), first)
