"""Comparisons of made-up bodies and plates, of which every figure is known."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import ipman_rs as ip
from ipman_rs import Ground
from ipman_rs.body.soles import sole_vertices
from ipman_rs.data.force_plates import ForcePlates
from ipman_rs.gravity import GRAVITY
from ipman_rs.validation import MeasuredComparison, computed, figures
from ipman_rs.validation.comparison import beside_plates
from ipman_rs.validation.computed import SOLE, first_shares

RATE, FRAMES = 50.0, 100
TIMES = np.arange(FRAMES) / RATE
LEFT, RIGHT = np.array([0.1, 0.0, 0.02]), np.array([-0.1, 0.0, 0.02])  # m, on the floor


@pytest.fixture(scope="module")
def standing(lite):
    return np.asarray(ip.body.posed(lite, "standing"), float)


def swaying(standing, amplitude=0.0, up=0.0, frequency=1.0):
    """The body moved as a whole along x, and up, (T, V, 3)."""
    wave = np.sin(2 * np.pi * frequency * TIMES)
    return standing + np.stack([amplitude * wave, up * wave, 0 * wave], axis=1)[:, None]


def plates_of(cop, upward, along=None):
    """Two plates left and right of x = 0 that carry `upward` (T,) N with their centre at `cop` (T, 3), and a third one
    that nobody stands on, whose centre is garbage."""
    share = np.clip((cop[:, 0] - RIGHT[0]) / (LEFT[0] - RIGHT[0]), 0, 1)
    forces = np.zeros((len(cop), 3, 3))
    forces[:, 0, 1], forces[:, 1, 1], forces[:, 2, 1] = share * upward, (1 - share) * upward, 3.0
    if along is not None:
        forces[:, 0] += along
    points = np.stack([np.broadcast_to(LEFT, cop.shape), np.broadcast_to(RIGHT, cop.shape)], axis=1)
    garbage = np.full((len(cop), 1, 3), 77.0)
    garbage[::2] = np.nan
    nothing = np.zeros_like(forces)
    points = np.concatenate([points, garbage], axis=1)
    return ForcePlates(TIMES, forces, points, nothing, np.array([0.0, 1.0, 0.0]), "made up")


def compared(lite, bodies, plates=None, reference=None, **options):
    return MeasuredComparison("made up", TIMES, computed(bodies, lite.template, plates), plates, reference, **options)


def test_standing_still(lite, standing):
    bodies = swaying(standing)
    com = ip.mass_properties(standing, lite.template).center
    cop = np.tile([com[0] + 0.01, 0, 0.02], (FRAMES, 1))
    one = compared(lite, bodies, plates_of(cop, np.full(FRAMES, 600.0)), np.tile(com + [0, 0.03, 0.04], (FRAMES, 1)))
    assert one.kind == "quiet standing"
    np.testing.assert_allclose(one.measured, cop, atol=1e-15)  # neither 77 m nor NaN of the third plate
    found = figures(one)
    assert found["mass"]["plates"] == pytest.approx(603 / GRAVITY)
    assert found["standing"]["offset"] == pytest.approx([com[2] - 0.02, -0.01])  # forward is z, left is x
    assert found["standing"]["sway_cop"] == pytest.approx(0, abs=1e-12)
    exact = found["com"]["methods"]["exact"]
    assert exact["distance"] == pytest.approx(0.05)
    np.testing.assert_allclose(exact["mean"], [-0.04, 0, -0.03], atol=1e-9)  # forward, left, up
    np.testing.assert_allclose(exact["rms"], [0.04, 0, 0.03], atol=1e-9)
    for method in ("pcom", "vertex_mean", "sample_mean", "face_area"):
        other = ip.center_of_mass(standing, lite.template, method) - com - [0, 0.03, 0.04]
        assert found["com"]["methods"][method]["distance"] == pytest.approx(np.linalg.norm(other))
    phase = found["cop"]["all"]
    for gamma in (5, 10, 200):
        pressed = ip.center_of_pressure(standing, lite.template, Ground.y_up(standing[:, 1].min()), 100, gamma)
        assert phase["distance"][f"γ = {gamma}"] == pytest.approx(np.linalg.norm((pressed - cop[0])[[0, 2]]))
    left = (cop[0, 0] - RIGHT[0]) / 0.2
    assert found["shares"]["measured"] == pytest.approx(left)
    assert found["shares"]["computed"] == pytest.approx(0.5, abs=0.02)  # it stands symmetrically


def test_weight_of_somebody_who_bounces(lite, standing):
    """What moves up and down by u sin(ωt) pushes with m (g − uω² sin(ωt)): the weight comes out, and the force."""
    bodies, omega = swaying(standing, up=0.03), 2 * np.pi
    upward = 65.0 * (GRAVITY - 0.03 * omega**2 * np.sin(omega * TIMES))
    cop = np.tile([0.0, 0, 0.02], (FRAMES, 1))
    one = compared(lite, bodies, plates_of(cop, upward - 3.0))
    found = figures(one)
    assert one.kind == "movement in place"
    assert found["mass"]["plates"] == pytest.approx(65.0, rel=1e-3)
    assert found["mass"]["plates_std"] < 0.02
    assert found["force"]["share"] < 1e-3
    assert found["force"]["at_rest"] == pytest.approx(0.03 * omega**2 / GRAVITY / np.sqrt(2), rel=0.05)
    assert found["cop"]["all"]["frames"] == FRAMES - 2 * 9  # 1/6 s at both ends, without accelerations


def test_swaying_fast_moves_the_pressure_against_the_sway(lite, standing):
    """The CoP of a body that sways as a whole: x + h ω²/g · x, which statics misses."""
    bodies, omega = swaying(standing, amplitude=0.02), 2 * np.pi
    com = ip.mass_properties(standing, lite.template).center
    x = 0.02 * np.sin(omega * TIMES)
    cop = np.stack([com[0] + x * (1 + com[1] * omega**2 / GRAVITY), 0 * x, 0 * x + com[2]], axis=1)
    plates = plates_of(np.tile(RIGHT, (FRAMES, 1)), np.full(FRAMES, 600.0))  # all on one plate
    plates = replace(plates, points=np.broadcast_to(cop[:, None], (FRAMES, 3, 3)))
    distance = figures(compared(lite, bodies, plates))["cop"]["all"]["distance"]
    static = np.abs(cop[:, 0] - com[0] - x)[9:-9].mean()
    assert distance["at rest: g(CoM)"] == pytest.approx(static, rel=1e-6)
    assert static > 0.04
    assert distance["moving: ZMP of the CoM"] < 2e-3 * static
    assert distance["moving: ZMP of the parts"] < 2e-3 * static


def test_walking_is_on_one_plate_after_the_other(lite, standing):
    bodies = swaying(standing)
    x = 0.15 * np.sign(np.sin(np.pi * TIMES)) * np.clip(3 * np.abs(np.sin(np.pi * TIMES)), 0, 1)
    cop = np.stack([x, 0 * x, 0 * x + 0.02], axis=1)
    plates = plates_of(cop, np.full(FRAMES, 600.0))
    outline = np.array([[-1, 0, -1], [1, 0, -1], [1, 0, 1], [-1, 0, 1]], float)
    one = compared(lite, bodies, replace(plates, corners=np.stack([outline] * 3)))
    vars(one)["kind"] = "walking"
    single, double = one.phases["single support"], one.phases["double support"]
    assert not (single & double).any()
    np.testing.assert_array_equal(single | double, one.complete)
    np.testing.assert_array_equal(single, np.abs(x) >= 0.1 - 0.2 * 20 / 600)  # the other has less than 20 N


def test_unseen_bodies_do_not_count(lite, standing):
    bodies = swaying(standing)
    bodies[50:] += [9.0, 0, 0]
    seen = np.arange(FRAMES) < 50
    cop = np.tile([0.0, 0, 0.02], (FRAMES, 1))
    one = compared(lite, bodies, plates_of(cop, np.full(FRAMES, 600.0)), seen=seen)
    assert one.complete.sum() == 50
    assert one.kind == "quiet standing"
    assert figures(one)["standing"]["distance"] < 0.1


def test_forces_that_are_no_numbers_are_no_foot_beside_the_plates(lite, standing):
    cop = np.tile([0.0, 0, 0.02], (FRAMES, 1))
    plates = plates_of(cop, np.full(FRAMES, 600.0))
    plates.forces[60:, 0] = np.nan  # the person stands on it, too
    one = compared(lite, swaying(standing), plates)
    assert not one.beside.any()
    np.testing.assert_array_equal(one.complete, np.arange(FRAMES) < 60)
    assert one.weight == pytest.approx((600 + 3) / GRAVITY, rel=1e-6)  # 3 N of the third
    assert figures(one)["flags"] == ["the forces of plate 1 are no numbers in 40 of 100 frames: they are left out"]


@pytest.mark.parametrize(
    ("load", "rate", "told"),
    [
        (
            600.0,
            10.0,
            ["10 frames a second: accelerations, and with them the ZMP and the weight of who moves, need 24"],
        ),
        (0.0, 50.0, ["no weight by the plates: in no frame is a plate loaded"]),
        (np.nan, 50.0, ["no weight by the plates: in no frame is a plate loaded"]),
    ],
)
def test_why_there_is_no_weight_and_no_acceleration(lite, standing, load, rate, told):
    plates = plates_of(np.tile([0.0, 0, 0.02], (FRAMES, 1)), np.full(FRAMES, load))
    one = MeasuredComparison("slow", TIMES * RATE / rate, computed(swaying(standing), lite.template, plates), plates)
    said = figures(one)["flags"]
    assert len(said) >= len(told)
    assert all(any(each.startswith(start) for each in said) for start in told)


def test_what_empty_plates_read_is_no_weight(lite, standing):
    upward = np.where(TIMES < 1, 600.0, 0.0)
    plates = plates_of(np.tile([0.05, 0, 0.02], (FRAMES, 1)), upward)
    offset = np.array([1.0, -17.0, 2.0])
    plates.forces[:, 0] += offset
    one = compared(lite, swaying(standing), plates)
    np.testing.assert_allclose(one.unloaded, offset + [0, 3, 0], atol=1e-12)
    np.testing.assert_allclose(one.force[one.complete], np.tile([0, 600.0, 0], (50, 1)), atol=1e-9)


def test_feet_beside_the_plates():
    square = np.array([[0, 0, 0], [0.5, 0, 0], [0.5, 0, 0.5], [0, 0, 0.5]])[None]
    soles = np.zeros((40, 2, 3)) + [0.25, 0.01, 0.25]
    soles[:, 1, 0] = 0.7  # beside the plate
    soles[10:20, 1, 1] = 0.2  # lifted
    soles[20:30, 1, 2] += 2.0 / RATE * np.arange(10)  # low, but quick
    soles[30:, 1, 0] = 0.4  # on it
    found = beside_plates(soles, RATE, Ground.y_up(), square)
    middles = np.array([5, 15, 25, 35])
    np.testing.assert_array_equal(found[middles], [True, False, False, False])
    np.testing.assert_array_equal(beside_plates(soles, RATE, Ground.y_up(), square[:, ::-1])[middles], found[middles])
    assert not beside_plates(soles, RATE, Ground.y_up(), None).any()


def test_a_foot_that_is_down_without_a_centre_of_pressure_is_beside_the_plates(lite, standing):
    """Both feet stand; from 1 s on only the plate under the left one has a load. Outlines are not known."""
    upward = np.full(FRAMES, 600.0)
    cop = np.where(TIMES[:, None] < 1, (LEFT + RIGHT) / 2, LEFT)
    one = compared(lite, swaying(standing), plates_of(cop, upward), standing=61.2)
    np.testing.assert_array_equal(one.beside, TIMES >= 1)
    np.testing.assert_array_equal(one.complete, TIMES < 1)
    found = figures(one)
    assert found["frames_beside_plates"] == 50
    assert found["flags"] == ["a foot is on the floor beside the plates in 50 of 100 loaded frames: they are left out"]
    lifted = swaying(standing)
    right = np.isin(np.arange(lite.num_vertices), sole_vertices(lite.template, SOLE)) & (standing[:, 0] < 0)
    lifted[50:, right, 1] += 0.05
    assert not compared(lite, lifted, plates_of(cop, upward)).beside[50:].any()


def test_one_plate_under_both_feet_is_not_beside_them(lite, standing):
    """Its centre goes from foot to foot."""
    cop = (LEFT + RIGHT) / 2 + np.outer(np.cos(2 * np.pi * TIMES), (LEFT - RIGHT) / 2)
    plates = plates_of(cop, np.full(FRAMES, 600.0))
    plates = replace(plates, forces=plates.forces.sum(axis=1, keepdims=True), points=cop[:, None])
    plates = replace(plates, moments=np.zeros((FRAMES, 1, 3)))
    assert not compared(lite, swaying(standing), plates).beside.any()


def test_what_is_odd_about_the_plates(lite, standing):
    """A weight that changes by 10 %, and not that of standing still."""
    upward = GRAVITY * (66.0 + 6.6 * np.sqrt(2) * np.sin(2 * np.pi * TIMES))
    one = compared(lite, swaying(standing), plates_of(np.tile([0, 0, 0.02], (FRAMES, 1)), upward - 3), standing=60.0)
    assert one.mass == 60.0
    assert figures(one)["flags"] == [
        "weight by the plates: 66.0 ± 6.6 kg, a spread of 10%, expected up to 5%: is a foot beside the plates?",
        "weight by the plates: 66.0 kg, but 60.0 kg standing still, which is taken",
    ]


def test_tables_are_in_the_persons_own_axes(lite, standing):
    """Turned to face x: forward is x, left is −z. The reference lies 3 cm behind, 2 cm left, 1 cm below."""
    turn = np.array([[0.0, 0, 1], [0, 1, 0], [-1, 0, 0]])
    bodies = swaying(standing) @ turn.T
    com = ip.mass_properties(bodies[0], lite.template).center
    reference = np.tile(com + [-0.03, -0.01, -0.02], (FRAMES, 1))
    one = compared(lite, bodies, None, reference, reference_name="Plug-in Gait")
    np.testing.assert_allclose(one.forward, np.tile([1.0, 0, 0], (FRAMES, 1)), atol=1e-6)
    found = figures(one)["com"]
    assert (found["judge"], found["axes"]) == ("Plug-in Gait", ["forward", "left", "up"])
    np.testing.assert_allclose(found["methods"]["exact"]["mean"], [0.03, -0.02, 0.01], atol=1e-6)


def test_shares_by_the_nearer_plate():
    points = np.array([[[0.0, 0, 0], [0.4, 0.05, 9], [0.6, 0, 0], [1.0, 0, -3]]])
    pressure = np.array([[1.0, 2.0, 3.0, 4.0]])
    centers = np.array([[[0.0, 0, 0], [np.nan] * 3, [1.0, 0, 0]]])
    assert first_shares(points, pressure, np.array([[5.0, 0, 5]]), centers) == pytest.approx(3 / 10)
    assert np.isnan(first_shares(points, pressure, np.array([[5.0, 0, 0]]), centers)).all()


def test_soles_are_on_the_floor(lite, standing):
    rows = sole_vertices(lite.template, SOLE)
    feet = standing[rows]
    assert feet[:, 1].max() < 0.04
    assert set(np.sign(feet[:, 0])) == {-1, 1}
    assert len(rows) < 0.1 * lite.num_vertices


@pytest.mark.parametrize(("what", "scale"), [("centre of mass", 1000.0), ("centre of pressure", 1000.0)])
def test_millimetres_are_named(lite, standing, what, scale):
    cop = np.tile([0.01, 0, 0.02], (FRAMES, 1))
    plates, reference = plates_of(cop, np.full(FRAMES, 600.0)), None
    if what == "centre of mass":
        reference = scale * np.tile([0.1, 0.9, 1.0], (FRAMES, 1))
    else:
        plates = replace(plates, points=scale * (plates.points + 1))
    with pytest.raises(ValueError, match=f"measured {what} is .* m beside the body .* expected both in the same axes"):
        compared(lite, swaying(standing), plates, reference)
