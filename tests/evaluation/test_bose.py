"""BoSE against shapely: hull of the contacts, and whether it holds the centre of mass."""

from __future__ import annotations

import numpy as np
import pytest
import trimesh
from shapely import MultiPoint, Point

import ipman_rs as ip
from ipman_rs.evaluation import bose

FLOOR, SLOPE = ip.Ground.y_up(), ip.Ground((0.2, 1.0, -0.1), 0.03)
GROUNDS = pytest.mark.parametrize("ground", [FLOOR, SLOPE])


@pytest.fixture(scope="module")
def block():
    """A block of human size in two parts."""
    mesh = trimesh.creation.box((0.5, 1.6, 0.3)).subdivide().subdivide()
    vertices = np.array(mesh.vertices) + [0.0, 0.8, 0.0]
    upper = vertices[np.array(mesh.faces)].mean(axis=1)[:, 1] > 0.8
    return ip.BodyTemplate(vertices, np.array(mesh.faces), upper.astype(int), num_samples=800)


def crowd(block, ground):
    """Blocks on this ground that lean, so that every third or so has its centre of mass beside its base, a little in
    and over the ground; one hangs in the air."""
    draw = np.random.default_rng(4)
    lean, shift = draw.uniform(-0.6, 0.6, (2, 60, 1)), draw.uniform(-0.015, 0.015, (60, 1))
    bodies = block.vertices + 0.001 * draw.standard_normal((60, block.num_vertices, 3))
    bodies[..., 0] += lean[0] * bodies[..., 1]
    bodies[..., 2] += 0.5 * lean[1] * bodies[..., 1]
    bodies[..., 1] += shift
    bodies[7, :, 1] += 1.0
    e1, e2 = ground.axes()
    return bodies @ np.stack([e1, ground.normal, -e2]) + ground.height * ground.normal


@pytest.fixture(scope="module")
def bodies(block):
    return crowd(block, FLOOR)


def judged(vertices, template, ground, tau, *, absolute=True, least=1):
    """For each body: 1, 0, or −1 with fewer contacts than `least`. By shapely, from samples and centre of mass."""
    found = []
    centers, samples = ip.center_of_mass(vertices, template), ip.sample_surface(vertices, template)
    e1, e2 = ground.axes()
    for center, body in zip(centers, samples, strict=True):
        heights = body @ ground.normal - ground.height
        touching = body[(np.abs(heights) if absolute else heights) < tau]
        flat = [(p @ e1, p @ e2) for p in touching]
        hull = MultiPoint(flat).convex_hull
        found.append(-1 if len(flat) < least else int(hull.covers(Point(center @ e1, center @ e2))))
    return np.array(found)


@GROUNDS
@pytest.mark.parametrize("tau", [0.1, 0.03])
def test_paper(block, ground, tau):
    bodies = crowd(block, ground)
    found = bose(bodies, block, ground, threshold=tau)
    expected = judged(bodies, block, ground, tau).clip(min=0)
    np.testing.assert_array_equal(found, expected)
    assert 15 < expected.sum() < 50  # both kinds are there
    if tau == 0.1:
        np.testing.assert_array_equal(found, bose(bodies, block, ground))


@GROUNDS
def test_strict_is_the_body_snapped_to_the_floor(block, ground):
    bodies = crowd(block, ground)
    lowest = (bodies @ ground.normal - ground.height).min(axis=1)
    snapped = bodies - lowest[:, None, None] * ground.normal
    expected = judged(snapped, block, ground, 0.025).clip(min=0)
    np.testing.assert_array_equal(bose(bodies, block, ground, "strict"), expected)
    assert 0 < expected.sum() < len(bodies)
    far = bodies + 3.0 * ground.normal
    np.testing.assert_array_equal(bose(far, block, ground, "strict"), expected)
    assert not bose(far, block, ground).any()


def test_released(block, bodies):
    """Ten contacts or fewer count as none (−1); agreement with the labels counts −1 like any other."""
    verdicts = judged(bodies, block, FLOOR, 0.02, absolute=False, least=11)
    assert set(verdicts) == {-1, 0, 1}
    found = bose(bodies, block, FLOOR, "released", threshold=0.02)
    np.testing.assert_array_equal(found, verdicts)
    labels = np.random.default_rng(0).integers(-1, 2, len(bodies))
    agreement = bose(bodies, block, FLOOR, "released", threshold=0.02, labels=labels)
    np.testing.assert_array_equal(agreement, verdicts == labels)
    unknown = np.where(np.arange(len(bodies)) < 3, np.nan, labels)
    assert np.isnan(bose(bodies, block, FLOOR, "released", 0.02, labels=unknown)).nonzero()[0].tolist() == [0, 1, 2]


def test_a_ground_for_each_body(block, bodies):
    """Moved along with its body, a ground changes nothing."""
    shift = np.linspace(-2, 2, len(bodies))
    ground = ip.Ground(np.broadcast_to([0.0, 1.0, 0.0], (len(bodies), 3)), shift)
    moved = bodies + shift[:, None, None] * [0.0, 1.0, 0.0]
    for mode in ("paper", "strict"):
        expected = bose(bodies, block, FLOOR, mode)
        np.testing.assert_array_equal(bose(moved, block, ground, mode), expected)


@pytest.mark.parametrize("mode", ["paper", "released", "strict"])
def test_a_bad_body_is_nan_and_leaves_the_others_alone(block, bodies, mode):
    expected = bose(bodies, block, FLOOR, mode)
    spoilt = bodies.copy()
    spoilt[11, 2, 0] = np.nan
    found = bose(spoilt, block, FLOOR, mode)
    assert np.isnan(found[11])
    np.testing.assert_array_equal(np.delete(found, 11), np.delete(expected, 11))


def test_shapes(block, bodies):
    for mode in ("paper", "released", "strict"):
        assert bose(bodies[0], block, FLOOR, mode).shape == ()
        assert bose(bodies.reshape(6, 10, -1, 3), block, FLOOR, mode).shape == (6, 10)
        assert bose(bodies[:0], block, FLOOR, mode).shape == (0,)


def test_bad_input(block, bodies):
    with pytest.raises(ValueError, match="bose_mode: expected one of paper, released, strict"):
        bose(bodies, block, FLOOR, "lenient")  # type: ignore[arg-type]
    with pytest.raises(ValueError, match='labels: expected with bose_mode="released" only'):
        bose(bodies, block, FLOOR, labels=np.ones(len(bodies)))
    with pytest.raises(ValueError, match=r"labels: expected one per body, \(60,\), got \(3,\)"):
        bose(bodies, block, FLOOR, "released", labels=np.ones(3))
    with pytest.raises(ValueError, match="threshold: expected positive metres"):
        bose(bodies, block, FLOOR, threshold=0.0)
    with pytest.raises(ValueError, match="vertices: expected"):
        bose(bodies[:, :5], block, FLOOR)
