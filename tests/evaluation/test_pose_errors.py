"""Position errors against plain loops, the alignment against scipy's."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.spatial import procrustes
from scipy.spatial.transform import Rotation

from ipman_rs.evaluation import aligned, body_errors, mpjpe, pa_mpjpe, pve, similarity


@pytest.fixture
def draw():
    return np.random.default_rng(0)


@pytest.fixture
def pairs(draw):
    true = draw.standard_normal((40, 24, 3))
    return true + 0.3 * draw.standard_normal(true.shape), true


def mean_distance(first, second):
    return sum(math.dist(p, q) for p, q in zip(first, second, strict=True)) / len(first)


def test_mpjpe_by_loops(pairs):
    found, in_world, hips = mpjpe(*pairs), mpjpe(*pairs, root=None), mpjpe(*pairs, root=(1, 2))
    for i, (body, truth) in enumerate(zip(*pairs, strict=True)):
        moved = [p - body[0] + truth[0] for p in body]
        assert found[i] == pytest.approx(mean_distance(moved, truth), rel=1e-12)
        assert in_world[i] == pytest.approx(mean_distance(body, truth), rel=1e-12)
        moved = [p - (body[1] + body[2]) / 2 + (truth[1] + truth[2]) / 2 for p in body]
        assert hips[i] == pytest.approx(mean_distance(moved, truth), rel=1e-12)


def test_the_errors_of_bodies_are_pelvis_on_pelvis(pairs, draw):
    """A body that is the true one moved has none of the three; one that is scaled has no PA-MPJPE, and errors as long
    as its points are from the pelvis, times the scale."""
    _, joints = pairs
    vertices = draw.standard_normal((40, 50, 3))
    moved = body_errors(vertices + [1.0, 2.0, 3.0], joints + [1.0, 2.0, 3.0], vertices, joints)
    assert max(np.abs(error).max() for error in moved) < 1e-14
    scaled = body_errors(1.25 * vertices, 1.25 * joints, vertices, joints)
    assert scaled.pa_mpjpe.max() < 1e-14
    for i, (skin, bones) in enumerate(zip(vertices, joints, strict=True)):
        pelvis = np.broadcast_to(bones[0], (50, 3))
        assert scaled.mpjpe[i] == pytest.approx(0.25 * mean_distance(bones, pelvis[:24]), rel=1e-12)
        assert scaled.pve[i] == pytest.approx(0.25 * mean_distance(skin, pelvis), rel=1e-12)


def test_pve_by_loops(pairs):
    (bodies, truths), roots = pairs, np.random.default_rng(1).standard_normal((2, 40, 3))
    in_world, at_pelvis = pve(bodies, truths), pve(bodies, truths, *roots)
    for i, (body, truth) in enumerate(zip(bodies, truths, strict=True)):
        assert in_world[i] == pytest.approx(mean_distance(body, truth), rel=1e-12)
        moved = [p - roots[0, i] for p in body], [p - roots[1, i] for p in truth]
        assert at_pelvis[i] == pytest.approx(mean_distance(*moved), rel=1e-12)


def test_pa_mpjpe_by_scipys_rotation(pairs):
    """scipy finds the rotation; the best scale for it is a division, the best shift moves mean onto mean."""
    found = pa_mpjpe(*pairs)
    for i, (body, truth) in enumerate(zip(*pairs, strict=True)):
        p, q = body - body.mean(axis=0), truth - truth.mean(axis=0)
        turned = Rotation.align_vectors(q, p)[0].apply(p)
        scale = (turned * q).sum() / (p * p).sum()
        assert found[i] == pytest.approx(mean_distance(scale * turned, q), rel=1e-9)


def test_alignment_is_scipys(pairs):
    """scipy's Procrustes scales both to unit size and allows reflections: compared where none is better."""
    for points, target in zip(*pairs, strict=True):
        unit, moved, disparity = procrustes(target, points)
        size = np.linalg.norm(target - target.mean(axis=0))
        off = aligned(points, target) - target
        assert (off**2).sum() == pytest.approx(disparity * size**2, rel=1e-10)
        assert pa_mpjpe(points, target) == pytest.approx(mean_distance(size * moved, size * unit), rel=1e-10)


def test_similarity_is_found_again(draw):
    points = draw.standard_normal((5, 24, 3))
    turns, scales = Rotation.random(5, rng=draw).as_matrix(), draw.uniform(0.5, 2, 5)
    shifts = draw.standard_normal((5, 3))
    target = scales[:, None, None] * points @ turns.swapaxes(1, 2) + shifts[:, None]
    scale, rotation, shift = similarity(points, target)
    np.testing.assert_allclose(scale, scales, rtol=1e-12)
    np.testing.assert_allclose(rotation, turns, atol=1e-12)
    np.testing.assert_allclose(shift, shifts, atol=1e-12)
    assert pa_mpjpe(points, target).max() < 1e-12


def test_a_mirrored_body_is_not_reflected_back(draw):
    points = draw.standard_normal((24, 3))
    scale, rotation, _ = similarity(points, points * [-1, 1, 1])
    assert np.linalg.det(rotation) == pytest.approx(1)
    assert 0 < scale < 1
    assert pa_mpjpe(points, points * [-1, 1, 1]) > 0.1


def test_points_that_are_all_one():
    assert pa_mpjpe(np.zeros((4, 3)), np.arange(12.0).reshape(4, 3)) > 0


@pytest.mark.parametrize("metric", [mpjpe, pa_mpjpe, pve])
@pytest.mark.parametrize("bad", [np.nan, np.inf, -np.inf])
def test_a_bad_body_is_nan_and_leaves_the_others_alone(pairs, metric, bad):
    for spoilt in range(2):
        arrays = [each.copy() for each in pairs]
        arrays[spoilt][3, 7, 1] = bad
        found = metric(*arrays)
        assert np.isnan(found[3])
        np.testing.assert_array_equal(np.delete(found, 3), np.delete(metric(*pairs), 3))


def test_any_batch():
    assert mpjpe(np.zeros((24, 3)), np.ones((24, 3))).shape == ()
    assert mpjpe(np.zeros((2, 5, 24, 3)), np.ones((2, 5, 24, 3))).shape == (2, 5)
    for metric in (mpjpe, pa_mpjpe, pve):
        assert metric(np.zeros((0, 24, 3)), np.ones((0, 24, 3))).shape == (0,)


def test_bad_input():
    with pytest.raises(ValueError, match=r"vertices: expected two arrays of one shape.*\(3, 3\) and \(4, 3\)"):
        pve(np.zeros((3, 3)), np.zeros((4, 3)))
    with pytest.raises(ValueError, match=r"joints: expected points \(\.\.\., N, 3\), got \(3, 2\)"):
        mpjpe(np.zeros((3, 2)), np.zeros((3, 2)))
    with pytest.raises(ValueError, match=r"got \(5, 0, 3\)"):
        pa_mpjpe(np.zeros((5, 0, 3)), np.zeros((5, 0, 3)))
    with pytest.raises(ValueError, match="expected both or none"):
        pve(np.zeros((4, 3)), np.zeros((4, 3)), np.zeros(3))
    with pytest.raises(TypeError, match="joints: expected real numbers"):
        mpjpe([["a"] * 3], [["b"] * 3])
