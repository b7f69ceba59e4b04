"""Accelerations of paths, and the zero-moment point, against motions that have them in closed form."""

from __future__ import annotations

import numpy as np
import pytest

from ipman_rs import Ground
from ipman_rs.gravity import GRAVITY
from ipman_rs.validation.acceleration import CUTOFF, accelerations
from ipman_rs.validation.zero_moment_point import along_force, zero_moment_point, zero_moment_point_of_parts

FLOOR = Ground.y_up(0.1)


def test_at_rest_it_is_the_projection(rng):
    com = rng.normal(size=(7, 3))
    np.testing.assert_allclose(zero_moment_point(com, np.zeros((7, 3)), FLOOR), FLOOR.project(com), atol=1e-15)


def test_the_linear_inverted_pendulum_turns_about_one_point():
    """x(t) = p + a cosh(ωt) + b sinh(ωt), ω² = g/h, at one height h: the pendulum on the point p."""
    height, point = 0.9, np.array([0.3, -0.2])
    omega = np.sqrt(GRAVITY / height)
    t = np.linspace(-0.4, 0.4, 31)[:, None]
    away = np.cosh(omega * t) * [0.02, 0.05] + np.sinh(omega * t) * [0.1, -0.03]
    com = np.stack([point[0] + away[:, 0], np.full(31, 0.1 + height), point[1] + away[:, 1]], axis=1)
    acceleration = np.stack([omega**2 * away[:, 0], np.zeros(31), omega**2 * away[:, 1]], axis=1)
    found = zero_moment_point(com, acceleration, FLOOR)
    np.testing.assert_allclose(found, np.broadcast_to([point[0], 0.1, point[1]], (31, 3)), atol=1e-14)


def test_bouncing_and_leaning():
    """3 m/s² forwards while going up with g/2: h · 3 / (1.5 g) behind the centre of mass."""
    found = zero_moment_point([0.0, 1.1, 0.0], [3.0, GRAVITY / 2, 0.0], FLOOR)
    np.testing.assert_allclose(found, [-1.0 * 3.0 / (1.5 * GRAVITY), 0.1, 0.0], atol=1e-15)


def test_any_axis_may_be_up():
    com, acceleration = np.array([0.2, 0.3, 1.0]), np.array([0.5, -1.0, 0.7])
    turned = zero_moment_point(com[[0, 2, 1]] * [1, 1, -1], acceleration[[0, 2, 1]] * [1, 1, -1], Ground.y_up())
    found = zero_moment_point(com, acceleration, Ground.z_up())
    np.testing.assert_allclose(found, [turned[0], -turned[2], 0], atol=1e-15)


def test_nobody_pulls_at_the_floor():
    assert np.isnan(zero_moment_point([0.0, 1.0, 0.0], [0.0, -GRAVITY, 0.0], FLOOR)).all()
    assert np.isnan(along_force([0.0, 1.0, 0.0], [10.0, -1.0, 0.0], FLOOR)).all()


def test_along_the_force_is_the_same_point(rng):
    """Newton: the floor's force is m (a + g)."""
    com, acceleration = rng.normal(size=(5, 3)) + [0, 2, 0], rng.normal(size=(5, 3))
    force = 61.0 * (acceleration + [0, GRAVITY, 0])
    np.testing.assert_allclose(along_force(com, force, FLOOR), zero_moment_point(com, acceleration, FLOOR), atol=1e-13)


def test_acceleration_of_a_swing():
    """sin(2πft) has −(2πf)² sin(2πft); the filter, of fourth order there and back, passes 1 / (1 + (f/fc)⁴)."""
    rate, slow = 200.0, 1.0
    t = np.arange(800) / rate
    path = np.stack([0.05 * np.sin(2 * np.pi * slow * t), np.full(800, 0.9), 0.3 * t], axis=1)
    found = accelerations(path, rate)
    settled = slice(150, -150)
    passed = 1 / (1 + (slow / CUTOFF) ** 4)
    wanted = -passed * 0.05 * (2 * np.pi * slow) ** 2 * np.sin(2 * np.pi * slow * t)
    tolerance = 3e-4 * np.abs(wanted).max()  # of the digital filter
    np.testing.assert_allclose(found[settled, 0], wanted[settled], atol=tolerance)
    np.testing.assert_allclose(found[settled, 1:], 0, atol=1e-8)  # even motion has none
    assert np.isnan(found[:33]).all()
    assert np.isnan(found[-33:]).all()
    assert np.isfinite(found[34:-34]).all()


def test_noise_of_markers_is_kept_out(rng):
    """White noise of 1 mm would be an acceleration of √6 · 1 mm · rate² = 24 m/s² at 100 Hz."""
    noise = rng.normal(scale=1e-3, size=(2000, 3))
    assert np.nanstd(accelerations(noise, 100.0)) < 0.5


def test_too_few_frames():
    assert np.isnan(accelerations(np.zeros((20, 3)), 60.0)).all()
    with pytest.raises(ValueError, match="rate: expected 24 points a second or more for accelerations, got 20"):
        accelerations(np.zeros((100, 3)), 20.0)


def test_parts_that_move_together_are_one(rng):
    masses, points = rng.uniform(1, 5, size=4), rng.normal(size=(6, 4, 3)) + [0, 2, 0]
    acceleration = rng.normal(size=(6, 1, 3))
    whole = (masses[:, None] * points).sum(1) / masses.sum()
    found = zero_moment_point_of_parts(masses, points, np.broadcast_to(acceleration, (6, 4, 3)), FLOOR)
    np.testing.assert_allclose(found, zero_moment_point(whole, acceleration[:, 0], FLOOR), atol=1e-14)


def test_a_flywheel_moves_the_point():
    """Two masses on a wheel that gains speed: the CoM rests, the point moves by I ω̇ / (m g)."""
    radius, gain, height = 0.3, 4.0, 1.0
    points = np.array([[radius, 0.1 + height, 0], [-radius, 0.1 + height, 0]])
    accelerations_ = gain * np.array([[0, radius, 0], [0, -radius, 0]])  # about +z, from rest
    found = zero_moment_point_of_parts([2.0, 2.0], points, accelerations_, FLOOR)
    np.testing.assert_allclose(found, [4.0 * radius**2 * gain / (4.0 * GRAVITY), 0.1, 0], atol=1e-15)
