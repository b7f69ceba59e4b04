"""Errors against scipy and plain sums; the paired bootstrap against what is known of means."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial import procrustes
from scipy.spatial.transform import Rotation

from ipman_rs.evaluation import aligned, mpjpe, pa_mpjpe, paired, pve, similarity


@pytest.fixture
def draw():
    return np.random.default_rng(0)


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


def test_alignment_is_scipys(draw):
    """scipy scales both to unit size and allows reflections: compared where none is better."""
    for _ in range(10):
        target = draw.standard_normal((24, 3))
        points = target + 0.3 * draw.standard_normal((24, 3))
        unit, moved, disparity = procrustes(target, points)
        size = np.linalg.norm(target - target.mean(axis=0))
        off = aligned(points, target) - target
        assert (off**2).sum() == pytest.approx(disparity * size**2, rel=1e-10)
        expected = np.linalg.norm(size * (moved - unit), axis=1).mean()
        assert pa_mpjpe(points, target) == pytest.approx(expected, rel=1e-10)


def test_a_mirrored_body_is_not_reflected_back(draw):
    points = draw.standard_normal((24, 3))
    scale, rotation, _ = similarity(points, points * [-1, 1, 1])
    assert np.linalg.det(rotation) == pytest.approx(1)
    assert 0 < scale < 1
    assert pa_mpjpe(points, points * [-1, 1, 1]) > 0.1


def test_mpjpe_and_pve(draw):
    true = draw.standard_normal((3, 24, 3))
    moved = true + [0.1, 0.0, 0.0]
    np.testing.assert_allclose(mpjpe(moved, true), 0, atol=1e-15)
    np.testing.assert_allclose(mpjpe(moved, true, root=None), 0.1, rtol=1e-12)
    np.testing.assert_allclose(pve(moved, true), 0.1, rtol=1e-12)
    bent = true.copy()
    bent[:, 5] += [0.0, 0.24, 0.0]
    np.testing.assert_allclose(mpjpe(bent, true), 0.01, rtol=1e-12)


def test_points_that_are_all_one():
    assert pa_mpjpe(np.zeros((4, 3)), np.arange(12.0).reshape(4, 3)) > 0


def test_wrong_shapes():
    with pytest.raises(ValueError, match=r"expected two arrays of one shape.*\(3, 3\) and \(4, 3\)"):
        pve(np.zeros((3, 3)), np.zeros((4, 3)))
    with pytest.raises(ValueError, match="of one length"):
        paired(np.zeros(3), np.zeros(4))


def test_paired_interval(draw):
    """Of a normal sample it is mean ± 1.96 standard errors, within a few per cent; pairing removes what is common."""
    common, own = 100 * draw.standard_normal(400), draw.standard_normal(400)
    found = paired(common + own + 0.5, common)
    error = own.std() / 20
    assert found.mean == pytest.approx(0.5 + own.mean())
    assert found.low == pytest.approx(found.mean - 1.96 * error, abs=0.1 * error)
    assert found.high == pytest.approx(found.mean + 1.96 * error, abs=0.1 * error)
    assert found.excludes_zero
    assert found == paired(common + own + 0.5, common)
    assert not paired(own - own.mean(), np.zeros(400)).excludes_zero
