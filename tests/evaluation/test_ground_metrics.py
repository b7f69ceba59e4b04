"""Penetration, hover, skating, tilt and errors of both centres: plain loops and scipy's rotations are the judges."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import ipman_rs as ip
from ipman_rs.evaluation import com_error, cop_error, foot_skating, hover, lowest, penetration, root_tilt, tilt

SLOPE = ip.Ground((0.3, 1.0, -0.2), 0.1)
GROUNDS = [ip.Ground.y_up(), ip.Ground.z_up(-0.4), SLOPE]


@pytest.fixture
def draw():
    return np.random.default_rng(3)


def up(ground):
    return [float(x) for x in ground.normal]


def dot(a, b):
    return math.fsum(x * y for x, y in zip(a, b, strict=True))


@pytest.mark.parametrize("ground", GROUNDS)
def test_penetration_and_hover_by_loops(draw, ground):
    bodies = draw.standard_normal((30, 50, 3)) + 3 * draw.standard_normal((30, 1, 3))
    deep, high = penetration(bodies, ground), hover(bodies, ground)
    for i, body in enumerate(bodies):
        least = min(dot(point, up(ground)) - float(ground.height) for point in body)
        assert deep[i] == pytest.approx(max(-least, 0), abs=1e-12)
        assert high[i] == pytest.approx(max(least, 0), abs=1e-12)
    assert (deep > 0).any()
    assert (high > 0).any()
    assert not (deep * high).any()


def test_a_ground_for_each_body(draw):
    bodies, heights = draw.standard_normal((4, 9, 3)), draw.standard_normal(4)
    grounds = ip.Ground(draw.standard_normal((4, 3)), heights)
    for i in range(4):
        alone = ip.Ground(grounds.normal[i], heights[i])
        assert penetration(bodies, grounds)[i] == penetration(bodies[i], alone)
        assert tilt(bodies, -bodies, grounds)[i] == pytest.approx(tilt(bodies[i], -bodies[i], alone), abs=1e-12)
        assert cop_error(bodies[:, 0], bodies[:, 1], grounds)[i] == cop_error(bodies[i, 0], bodies[i, 1], alone)


@pytest.mark.parametrize("ground", GROUNDS)
def test_foot_skating_by_loops(draw, ground):
    """Feet that wander by millimetres about the ground, in three sequences of different lengths."""
    sequences = np.array(["a"] * 20 + ["b"] + ["c"] * 30)
    e1, e2 = ground.axes()
    base = ground.height * ground.normal + draw.standard_normal((1, 6, 1)) * e1
    feet = base + 0.004 * draw.standard_normal((51, 6, 1)) * ground.normal
    feet = feet + 0.01 * draw.standard_normal((51, 6, 1)) * e1 + 0.01 * draw.standard_normal((51, 6, 1)) * e2
    feet[5] += ground.normal
    found = foot_skating(feet, ground, sequences)
    for f in range(51):
        ways = []
        for n in range(6 if f and sequences[f] == sequences[f - 1] else 0):
            now, before = feet[f, n], feet[f - 1, n]
            if all(dot(p, up(ground)) - float(ground.height) < 0.005 for p in (now, before)):
                ways.append(math.hypot(dot(now - before, e1), dot(now - before, e2)))
        if ways:
            assert found[f] == pytest.approx(sum(ways) / len(ways), rel=1e-9)
        else:
            assert np.isnan(found[f])
    assert np.isnan(found).nonzero()[0].tolist()[:3] == [0, 5, 6]
    assert np.isnan(found[[20, 21]]).all()
    assert np.isfinite(found).sum() > 30


def test_a_foot_that_stands_does_not_skate():
    feet = np.zeros((4, 2, 3))
    feet[:, 1, 1] = [0.0, 0.1, 0.2, 0.0]
    feet[:, 1, 0] = [0.0, 0.5, 1.0, 1.5]  # the other one steps ahead through the air
    np.testing.assert_array_equal(foot_skating(feet, ip.Ground.y_up(), ["s"] * 4)[1:], 0.0)


def test_skating_of_shards_is_that_of_the_whole(draw):
    feet, names = 0.004 * draw.standard_normal((30, 5, 3)), np.repeat(["a", "b"], 15)
    whole = foot_skating(feet, ip.Ground.y_up(), names)
    for cut in range(1, 30):
        rest = foot_skating(feet[cut - 1 :], ip.Ground.y_up(), names[cut - 1 :])[1:]
        np.testing.assert_array_equal(np.append(foot_skating(feet[:cut], ip.Ground.y_up(), names[:cut]), rest), whole)


@pytest.mark.parametrize("ground", GROUNDS)
def test_tilt_by_scipys_rotations(draw, ground):
    """scipy aligns the pelvis, turns the true "up" with it, and measures the angle as that of a rotation."""
    true = draw.standard_normal((30, 24, 3))
    estimated = true @ Rotation.random(rng=draw).as_matrix() + 0.1 * draw.standard_normal(true.shape)
    other = ip.Ground(draw.standard_normal(3))
    found, beside = tilt(estimated, true, ground), tilt(estimated, true, ground, other)
    for i, (body, truth) in enumerate(zip(estimated, true, strict=True)):
        p, q = truth[:4] - truth[:4].mean(axis=0), body[:4] - body[:4].mean(axis=0)
        turn = Rotation.align_vectors(q, p)[0]
        for figure, normal in ((found[i], ground.normal), (beside[i], other.normal)):
            angle = 2 * math.asin(np.linalg.norm(turn.apply(normal) - ground.normal) / 2)
            assert figure == pytest.approx(angle, abs=1e-9)


def test_tilt_knows_no_heading_place_or_size(draw):
    true = draw.standard_normal((24, 3))
    for angle in (0.0, 1e-9, 0.1, 3.0):
        lean, heading = Rotation.from_rotvec([angle, 0, 0]), Rotation.from_rotvec([0, 2.0, 0])
        body = 1.1 * (heading * lean).apply(true) + [1.0, 2.0, 3.0]
        assert tilt(body, true, ip.Ground.y_up(5.0)) == pytest.approx(angle, rel=1e-6, abs=1e-15)
        turns = (heading * lean * Rotation.from_euler("y", 1)).as_matrix(), Rotation.from_euler("y", 1).as_matrix()
        assert root_tilt(*turns, ip.Ground.y_up()) == pytest.approx(angle, rel=1e-6, abs=1e-15)


def test_tilt_of_roots_is_that_of_their_joints(draw):
    """In a body model joints 0 to 3 turn with the root."""
    body = ip.load_body("anny-lite")
    pose = 0.5 * draw.standard_normal((2, 8, 24, 3))
    estimated, true = body(pose[0]).joints, body(pose[1]).joints
    roots = [Rotation.from_rotvec(each[:, 0]).as_matrix() for each in pose]
    np.testing.assert_allclose(tilt(estimated, true, SLOPE), root_tilt(*roots, SLOPE), atol=1e-9)


def test_tilt_in_another_world(draw):
    """The same body, z up in one world and y up in the other."""
    true = draw.standard_normal((24, 3))
    estimated = true[:, [0, 2, 1]] * [1, -1, 1]  # (x, y, z) with y up to (x, −z, y)
    assert tilt(estimated, true, ip.Ground.z_up(), ip.Ground.y_up()) == pytest.approx(0, abs=1e-12)
    assert tilt(estimated, true, ip.Ground.y_up()) == pytest.approx(np.pi / 2)


@pytest.mark.parametrize("ground", GROUNDS)
def test_errors_of_the_centres_by_loops(draw, ground):
    first, second = draw.standard_normal((2, 30, 3))
    in_space, along = com_error(first, second), cop_error(first, second, ground)
    for i, (p, q) in enumerate(zip(first, second, strict=True)):
        assert in_space[i] == pytest.approx(math.dist(p, q), rel=1e-12)
        height = dot(p - q, up(ground))
        assert along[i] == pytest.approx(math.dist(p - height * ground.normal, q), rel=1e-9)


@pytest.mark.parametrize("ground", GROUNDS)
def test_lowest_is_hover_less_penetration(ground):
    """Of which one is 0; along whatever normal."""
    bodies = np.random.default_rng(5).standard_normal((6, 20, 3)) + 4.0 * np.arange(-3, 3)[:, None, None]
    found = lowest(bodies, ground)
    np.testing.assert_array_equal(found, hover(bodies, ground) - penetration(bodies, ground))
    for body, height in zip(bodies, found, strict=True):
        assert height == pytest.approx(min(dot(point, up(ground)) for point in body) - float(ground.height), abs=1e-12)


def test_nan():
    points, floor = np.ones((3, 4, 3)), ip.Ground.y_up()
    points[1, 2, 0] = np.nan
    for found in (penetration(points, floor), hover(points, floor), tilt(points + np.eye(4, 3), points, floor)):
        assert np.isnan(found).tolist() == [False, True, False]
    assert np.isnan(com_error(points[:, 2], points[:, 0])).tolist() == [False, True, False]
    assert np.isnan(cop_error(points[:, 2], points[:, 0], floor)).tolist() == [False, True, False]
    assert np.isnan(foot_skating(0 * points, floor, ["a"] * 3)).all()  # no two frames in a row
    turns = np.broadcast_to(np.eye(3), (3, 3, 3)).copy()
    turns[1, 0, 0] = np.inf
    assert np.isnan(root_tilt(turns, np.broadcast_to(np.eye(3), (3, 3, 3)), floor)).tolist() == [False, True, False]


def test_bad_input():
    floor = ip.Ground.y_up()
    with pytest.raises(ValueError, match=r"centres of mass: expected two arrays of one shape \(\.\.\., 3\)"):
        com_error(np.zeros((2, 3)), np.zeros((3, 3)))
    with pytest.raises(ValueError, match=r"centres of mass: expected \(\.\.\., 3\), got \(2, 2\)"):
        com_error(np.zeros((2, 2)), np.zeros((2, 2)))
    with pytest.raises(ValueError, match="centres of pressure: expected two arrays of one shape"):
        cop_error(np.zeros(3), np.zeros((1, 3)), floor)
    with pytest.raises(ValueError, match="pelvis: expected three joints or more, got 2"):
        tilt(np.zeros((24, 3)), np.zeros((24, 3)), floor, pelvis=(0, 1))
    with pytest.raises(ValueError, match=r"rotations: expected two arrays \(\.\.\., 3, 3\)"):
        root_tilt(np.zeros((4, 3)), np.zeros((4, 3)), floor)
    with pytest.raises(ValueError, match=r"sequences: expected a name per frame, \(5,\), got \(4,\)"):
        foot_skating(np.zeros((5, 2, 3)), floor, ["a"] * 4)
    with pytest.raises(ValueError, match=r"feet: expected \(F, N, 3\), got \(2, 3\)"):
        foot_skating(np.zeros((2, 3)), floor, ["a"] * 2)
    with pytest.raises(ValueError, match="vertices: expected points"):
        penetration(np.zeros((0, 3)), floor)
    assert foot_skating(np.zeros((0, 2, 3)), floor, []).shape == (0,)
