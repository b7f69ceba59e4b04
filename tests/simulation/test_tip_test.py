"""The tip test: inertia of solids, boxes that tip, rolls against scipy's convex hull, bad input."""

from __future__ import annotations

import math

import numpy as np
import pytest
import trimesh
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial import ConvexHull
from scipy.spatial.transform import Rotation

import ipman_rs as ip
from ipman_rs import Status
from ipman_rs.gravity import GRAVITY
from ipman_rs.simulation import tip_test
from tests.helpers import solids

FLOOR = ip.Ground.y_up()


def on_floor(vertices):
    return vertices - [0.0, vertices[:, 1].min(), 0.0]


def template_of(mesh):
    return ip.BodyTemplate(np.array(mesh.vertices), np.array(mesh.faces), num_samples=10)


def test_inertia_of_a_box_a_ball_and_a_capsule():
    """Against the formulas of the textbook. Fine meshes are inside of ball and capsule: less by their edge squared."""
    width, height, depth = 0.4, 1.6, 0.6
    vertices, faces = solids.box((width, height, depth))
    box = tip_test(vertices, ip.BodyTemplate(vertices, faces, num_samples=10), FLOOR, density=1000.0)
    mass = 1000.0 * width * height * depth
    moments = mass / 12 * np.array([height**2 + depth**2, width**2 + depth**2, width**2 + height**2])
    np.testing.assert_allclose(box.inertia, np.diag(moments), atol=1e-12 * mass)
    np.testing.assert_allclose(box.mass, mass, rtol=1e-13)

    ball = trimesh.creation.icosphere(subdivisions=5, radius=0.4)
    found = tip_test(on_floor(ball.vertices), template_of(ball), FLOOR, density=1000.0)
    np.testing.assert_allclose(found.inertia, np.eye(3) * 0.4 * found.mass * 0.4**2, rtol=2e-3, atol=1e-6)

    radius, length = 0.2, 1.0
    capsule = trimesh.creation.capsule(height=length, radius=radius, count=[128, 128])
    found = tip_test(on_floor(np.array(capsule.vertices)), template_of(capsule), FLOOR, density=1000.0)
    cylinder, caps = math.pi * radius**2 * length, 4 / 3 * math.pi * radius**3
    about_axis = cylinder * radius**2 / 2 + caps * 2 / 5 * radius**2
    across = cylinder * (length**2 / 12 + radius**2 / 4) + caps * (
        2 / 5 * radius**2 + length**2 / 4 + 3 / 8 * length * radius
    )
    expected = 1000.0 * np.sort([about_axis, across, across])
    np.testing.assert_allclose(np.linalg.eigvalsh(found.inertia), expected, rtol=3e-3)


def test_a_box_on_a_slope_of_any_axes():
    """The ground's normal is up, wherever it points."""
    vertices, faces = solids.box((0.4, 1.6, 0.6))
    template = ip.BodyTemplate(vertices, faces, num_samples=10)
    turn = Rotation.from_rotvec([0.3, -1.0, 2.0])
    there = vertices @ turn.as_matrix().T + [3.0, -2.0, 1.0]
    up = turn.apply([0.0, 1.0, 0.0])
    found = tip_test(there, template, ip.Ground(up, up @ [3.0, -2.0, 1.0]))
    s, h, mass = 0.2, 0.8, 985.0 * 0.4 * 1.6 * 0.6
    barrier = mass * GRAVITY * (math.hypot(s, h) - h)
    inertia = mass * (0.4**2 + 1.6**2) / 3
    for name, value in {
        "margin": s, "height": h, "barrier": barrier, "push": math.sqrt(2 * barrier / inertia),
        "rate": math.sqrt(mass * GRAVITY * h / inertia), "lowest": 0.0, "tilt": 0.0, "drop": 0.0, "nudged_tilt": 0.0,
        "rest_margin": s, "rest_barrier": barrier,
    }.items():  # fmt: skip
        assert getattr(found, name) == pytest.approx(value, rel=1e-9, abs=1e-7), name
    assert found.stands()


def test_displacement_of_a_falling_box_is_the_pendulums():
    vertices, faces = solids.box((0.4, 1.6, 0.6))
    template = ip.BodyTemplate(vertices, faces, num_samples=10)
    angle = math.atan2(0.2, 0.8) + 0.02
    tilted = on_floor(Rotation.from_rotvec([0.0, 0.0, angle]).apply(vertices))
    found = tip_test(tilted, template, FLOOR)
    arm, square = math.hypot(0.2, 0.8), GRAVITY * math.hypot(0.2, 0.8) / ((0.4**2 + 1.6**2) / 3)
    theta, rate, count = 0.02, 0.0, 20_000
    for _ in range(count):
        rate += 0.3 / count * square * math.sin(theta)
        theta += 0.3 / count * rate
    assert found.displacement(0.3) == pytest.approx(arm * (theta - 0.02), rel=2e-3)  # the angle is small
    assert not found.stands()
    assert tip_test(vertices, template, FLOOR).displacement(0.3) == 0.0


def rest_of(vertices, com, down):
    """The height of the centre at rest, by small steps of the direction down: an integration of the steepest descent
    that knows nothing of edges and vertices."""
    points = vertices[ConvexHull(vertices).vertices] - com
    step, best = 2e-3, np.inf
    for _ in range(20_000):
        heights = points @ down
        lowest = points[np.argmax(heights)]
        if heights.max() < best - 1e-12:
            best = heights.max()
        else:
            step /= 2
            if step < 1e-8:
                break
        level = lowest - (lowest @ down) * down
        down = down - step * level / max(np.linalg.norm(level), 1e-12)
        down = down / np.linalg.norm(down)
    return best


@pytest.mark.parametrize("seed", range(6))
def test_the_roll_goes_down_to_a_facet_of_scipys_hull(seed):
    """Rest heights are those of facets under the centre of mass; which one, a small-step descent agrees."""
    rng = np.random.default_rng(seed)
    cloud = rng.normal(size=(60, 3)) * [0.25, 0.7, 0.4]
    mesh = trimesh.convex.convex_hull(cloud)
    template = template_of(mesh)
    vertices = on_floor(np.array(mesh.vertices))
    found = tip_test(vertices, template, FLOOR)
    com = found.center_of_mass
    hull = ConvexHull(vertices)
    below = []
    for facet, (*normal, offset) in zip(hull.simplices, hull.equations, strict=True):
        height = -(np.array(normal) @ com + offset)
        foot = com + height * np.array(normal)
        a, b, c = vertices[facet]
        weights = np.linalg.lstsq(np.stack([[*a, 1], [*b, 1], [*c, 1]]).T, [*foot, 1], rcond=None)[0]
        if (weights >= -1e-9).all():
            below.append(height)
    rest = found.height - found.drop / (found.mass * GRAVITY)
    assert min(abs(rest - height) for height in below) < 1e-9
    assert rest <= rest_of(vertices, com, np.array([0.0, -1.0, 0.0])) + 2e-3


@given(st.floats(0.02, 0.4), st.floats(0.3, 2.0), st.floats(-0.5, 0.5))
@settings(max_examples=40, deadline=None)
def test_boxes_of_all_sizes(width, height, tilt):
    """The closed form of a box tilted about its long edge."""
    vertices, faces = solids.box((width, height, 3.0))
    template = ip.BodyTemplate(vertices, faces, num_samples=10)
    found = tip_test(on_floor(Rotation.from_rotvec([0.0, 0.0, tilt]).apply(vertices)), template, FLOOR, tolerance=0.0)
    s, h = width / 2, height / 2
    limit = math.atan2(s, h)
    if abs(abs(tilt) - limit) < 1e-6 or abs(tilt) < 1e-6:
        return
    start = h * math.cos(tilt) + s * abs(math.sin(tilt))
    assert found.height == pytest.approx(start, abs=1e-12)
    falls = abs(tilt) > limit
    assert found.tilt == pytest.approx(math.pi / 2 - abs(tilt) if falls else abs(tilt), abs=1e-8)
    assert found.drop == pytest.approx(found.mass * GRAVITY * (start - (s if falls else h)), abs=1e-6)


def test_people(anny):
    """Who stands, and who does not: what the names of the poses promise of stiff bodies."""
    firm = ("standing", "warrior", "chair", "squat", "plank", "cobra", "lying", "sitting")
    vertices = np.stack([ip.body.posed(anny, name) for name in (*firm, "lean_past_toes")])
    found = tip_test(vertices, anny.template, FLOOR)
    np.testing.assert_array_equal(found.stands(), [True] * len(firm) + [False])
    assert found.margin[-1] < -0.05
    exact = ip.center_of_mass(vertices, anny.template, "exact")
    np.testing.assert_allclose(found.center_of_mass, exact, atol=1e-14)  # added to the origin in another order
    solid = ip.mass_properties(vertices, anny.template)
    np.testing.assert_allclose(found.inertia, solid.inertia, rtol=1e-12, atol=1e-12)
    single = tip_test(vertices.astype(np.float32), anny.template, FLOOR)
    np.testing.assert_allclose(single.margin, found.margin, atol=2e-6)
    assert single.margin.dtype == np.float64


def test_bad_bodies_have_a_status_and_leave_the_others_alone(lite):
    good = ip.body.posed(lite, "standing")
    bodies = np.stack([good, good, good, good, good])
    bodies[1, 7, 2] = np.nan
    bodies[2, :, 2] = 0.0
    bodies[3, :, 1] += 0.2
    for precision in (np.float64, np.float32):
        found = tip_test(bodies.astype(precision), lite.template, FLOOR)
        assert found.status[[0, 4]].tolist() == [0, 0]
        assert found.status[1] == Status.NON_FINITE
        assert found.status[2] & Status.NO_VOLUME
        assert found.status[3] == Status.NO_CONTACT
        assert np.isnan(found.margin[1:4]).all()
        assert not found.stands()[1:4].any()
        assert found.mass[3] == pytest.approx(found.mass[0], rel=1e-6)
        alone = tip_test(good.astype(precision), lite.template, FLOOR)
        for name in ("margin", "push", "tilt", "drop", "nudged_tilt", "rest_push"):
            assert getattr(alone, name) == getattr(found, name)[0] == getattr(found, name)[4], name


def test_shapes_and_bad_arguments(lite):
    good = ip.body.posed(lite, "standing")
    found = tip_test(np.broadcast_to(good, (2, 3, *good.shape)), lite.template, FLOOR)
    assert found.margin.shape == (2, 3)
    assert found.inertia.shape == (2, 3, 3, 3)
    assert tip_test(np.zeros((0, *good.shape)), lite.template, FLOOR).stands().shape == (0,)
    for bad, message in (
        ({"tolerance": 0.2}, "tolerance: expected 0 to 0.03"),
        ({"tolerance": -1.0}, "tolerance: expected zero or more"),
        ({"contact": 0.0}, "contact: expected positive"),
        ({"nudge": math.nan}, "nudge: expected a finite number"),
        ({"density": [1.0, 2.0]}, "density: expected one number or"),
    ):
        with pytest.raises(ValueError, match=message):
            tip_test(good, lite.template, FLOOR, **bad)
