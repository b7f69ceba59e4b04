"""Bodies let go: free fall, boxes, the three engines, V-HACD, threads, bad input."""

from __future__ import annotations

import importlib.util
import math
import sys

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import ipman_rs as ip
from ipman_rs import Status
from ipman_rs.gravity import GRAVITY
from ipman_rs.simulation import fall, simulate, tip_test
from tests.helpers import solids

ENGINES = [
    name for name in fall.ENGINES if name != "bullet" or importlib.util.find_spec("pybullet")
]  # no wheels for all
FLOOR = ip.Ground.y_up()

SIZE = (0.4, 1.6, 0.6)
LIMIT = math.atan2(SIZE[0], SIZE[1])


@pytest.fixture(scope="module")
def box():
    vertices, faces = solids.box(SIZE)
    return vertices, ip.BodyTemplate(vertices, faces, num_samples=10)


def tilted(vertices, angle):
    turned = Rotation.from_rotvec([0.0, 0.0, -angle]).apply(vertices)
    return turned - [0.0, turned[:, 1].min(), 0.0]


@pytest.mark.parametrize("engine", ENGINES)
def test_free_fall(box, engine):
    """A body in the air falls g t²/2 and lands after √(2 h / g); every engine's steps are right to first order."""
    vertices, template = box
    height = 0.8
    landing = math.sqrt(2 * height / GRAVITY)
    times = (0.9 * landing, landing + 0.3)
    found = simulate(vertices + [0.0, height, 0.0], template, FLOOR, times, engine=engine, snap=False)
    assert found.status == Status.NO_CONTACT
    time = found.times[0]
    assert found.displacement[0] == pytest.approx(GRAVITY * time**2 / 2, abs=GRAVITY * time / 240)
    assert found.displacement[1] == pytest.approx(height, abs=0.01)
    assert found.tilt.max() < 0.02


@pytest.mark.parametrize("engine", ENGINES)
def test_a_box_stands_up_to_its_limit_and_falls_beyond(box, engine):
    vertices, template = box
    angles = (0.0, LIMIT - 0.05, LIMIT + 0.05)
    bodies = np.stack([tilted(vertices, angle) for angle in angles])
    found = simulate(bodies, template, FLOOR, (100 / 240, 5.0), engine=engine)
    assert found.displacement[0].max() < 2e-3
    assert found.tilt[:, 1] == pytest.approx([0.0, angles[1], math.pi / 2 - angles[2]], abs=0.02)
    # It falls towards +x, over the edge at +x, and comes to lie on that side.
    assert found.center[2, 1, 0] > found.center[2, 0, 0] > found.start[2, 0]
    assert found.fell().tolist() == [False, False, True]
    up = found.rotation[2, 1] @ Rotation.from_rotvec([0.0, 0.0, -angles[2]]).apply([0.0, 1.0, 0.0])
    np.testing.assert_allclose(up, [1.0, 0.0, 0.0], atol=0.02)


@pytest.mark.parametrize("engine", ENGINES)
def test_axes_and_far_away(box, engine):
    """Nothing depends on which way is up, or on where in the world it happens."""
    vertices, template = box
    body = tilted(vertices, LIMIT + 0.05)
    here = simulate(body, template, FLOOR, (0.4,), engine=engine)
    turn = Rotation.from_rotvec([1.0, 0.4, -2.0])
    shift = np.array([20.0, -7.0, 3.0])
    up = turn.apply([0.0, 1.0, 0.0])
    there = simulate(turn.apply(body) + shift, template, ip.Ground(up, up @ shift), (0.4,), engine=engine)
    # The engines solve for friction along axes of their own.
    assert there.displacement[0] == pytest.approx(here.displacement[0], rel=0.05)
    assert there.tilt[0] == pytest.approx(here.tilt[0], rel=0.05)
    np.testing.assert_allclose(there.start, turn.apply(here.start) + shift, atol=1e-9)
    np.testing.assert_allclose(there.posed(turn.apply(body) + shift)[0],
                               turn.apply(here.posed(body)[0]) + shift, atol=0.05)  # fmt: skip


def test_the_start_is_the_pose_put_on_its_ground(box):
    vertices, template = box
    found = simulate(vertices + [0.0, 0.05, 0.0], template, FLOOR, (0.0,))
    np.testing.assert_allclose(found.center_of_mass, [0.0, 0.85, 0.0], atol=1e-12)
    np.testing.assert_allclose(found.start, [0.0, 0.8, 0.0], atol=1e-12)
    np.testing.assert_allclose(found.posed(vertices + [0.0, 0.05, 0.0])[0], vertices, atol=1e-9)
    assert found.times.tolist() == [0.0]


@pytest.mark.slow
def test_people_agree_over_engines(anny):
    names = ("standing", "warrior", "squat", "plank", "lying", "lean_past_toes")
    vertices = np.stack([ip.body.posed(anny, name) for name in names])
    runs = {engine: simulate(vertices, anny.template, FLOOR, engine=engine) for engine in ENGINES}
    for engine, run in runs.items():
        assert run.fell().tolist() == [False] * 5 + [True], engine
        assert run.displacement[:5, 1].max() < 0.01, engine  # poses are not quite at rest: they settle, and rock
        np.testing.assert_allclose(run.displacement[5], runs["mujoco"].displacement[5], rtol=0.05)
    assert tip_test(vertices, anny.template, FLOOR).stands().tolist() == [True] * 5 + [False]


def test_bodies_at_rest_do_not_creep(lite):
    """Two bodies laid on the facet on which the roll ends: they stay within a tenth of a millimetre for two seconds."""
    vertices = np.stack([ip.body.posed(lite, name) for name in ("squat", "lying")])
    settled = simulate(vertices, lite.template, FLOOR, (3.0,)).posed(vertices)[:, 0]
    found = simulate(settled, lite.template, FLOOR)
    assert found.displacement.max() < 2e-4


@pytest.mark.parametrize("shape", ["hull", "vhacd"])
def test_threads_and_neighbours_change_no_bit(lite, shape):
    vertices = np.stack([ip.body.posed(lite, name) for name in ("squat", "lean_past_toes", "tree", "kneeling")])
    try:
        ip.set_num_threads(1)
        one = simulate(vertices, lite.template, FLOOR, (0.4,), shape=shape, resolution=32)
        ip.set_num_threads(3)
        three = simulate(vertices, lite.template, FLOOR, (0.4,), shape=shape, resolution=32)
        alone = simulate(vertices[1], lite.template, FLOOR, (0.4,), shape=shape, resolution=32)
    finally:
        ip.set_num_threads(None)
    np.testing.assert_array_equal(one.center, three.center)
    np.testing.assert_array_equal(one.rotation, three.rotation)
    np.testing.assert_array_equal(one.center[1], alone.center)


def test_decomposition_stands_on_its_own_hulls(lite):
    """The paper's mode: hulls of voxels, a centimetre or two off, put on the ground before anything is let go."""
    vertices = ip.body.posed(lite, "lying")
    found = simulate(vertices, lite.template, FLOOR, shape="vhacd", resolution=64)
    exact = simulate(vertices, lite.template, FLOOR)
    assert 0 < abs(found.start[1] - exact.start[1]) < 0.05
    assert not found.fell()
    np.testing.assert_array_equal(found.start[[0, 2]], exact.start[[0, 2]])


@pytest.mark.parametrize("engine", ENGINES)
def test_bad_bodies_have_a_status_and_leave_the_others_alone(lite, engine):
    good = ip.body.posed(lite, "squat")
    bodies = np.stack([good, good, good, good, good])
    bodies[1, 7, 2] = np.inf
    bodies[2, :, 2] = 0.0
    bodies[3, :, 1] += 0.3
    found = simulate(bodies, lite.template, FLOOR, (0.2,), engine=engine)
    assert found.status[[0, 4]].tolist() == [0, 0]
    assert found.status[1] == Status.NON_FINITE
    assert found.status[2] & Status.NO_VOLUME
    assert found.status[3] == Status.NO_CONTACT
    assert np.isnan(found.displacement[1:4]).all()
    alone = simulate(good, lite.template, FLOOR, (0.2,), engine=engine)
    np.testing.assert_array_equal(found.center[[0, 4]], np.stack([alone.center] * 2))


def test_who_fell_is_judged_after_two_seconds(box):
    """A box over its edge has moved by millimetres after 100 steps and tilted by hardly more: no verdict yet."""
    vertices, template = box
    bodies = np.stack([vertices, tilted(vertices, LIMIT + 0.02)])
    early = simulate(bodies, template, FLOOR, (100 / 240,))
    assert early.displacement[1, 0] > 10 * early.displacement[0, 0]
    assert early.tilt.max() < fall.FALLEN
    assert not early.has_verdict
    with pytest.raises(ValueError, match=r"times: whether a body fell is judged at 2 s or later, got 0.417 s"):
        early.fell()
    late = simulate(bodies, template, FLOOR, (100 / 240, 2.0))
    assert late.has_verdict
    assert late.fell().tolist() == [False, True]


def test_shapes_progress_and_nothing(lite):
    good = ip.body.posed(lite, "squat")
    seen = []
    found = simulate(np.broadcast_to(good, (2, 20, *good.shape)), lite.template, FLOOR, (0.02,), progress=seen.append)
    assert seen == [32, 40]
    assert found.displacement.shape == (2, 20, 1)
    assert found.rotation.shape == (2, 20, 1, 3, 3)
    empty = simulate(np.zeros((0, *good.shape)), lite.template, FLOOR)
    assert empty.tilt.shape == (0, 2)
    assert empty.status.shape == (0,)


@pytest.mark.parametrize(
    ("bad", "message"),
    [
        ({"engine": "havok"}, "engine: expected one of rapier, bullet, mujoco"),
        ({"shape": "mesh"}, "shape: expected one of hull, vhacd"),
        ({"times": ()}, "times: expected at least one"),
        ({"times": (2.0, 1.0)}, "times: expected ascending"),
        ({"times": (-1.0,)}, "times: expected zero or more"),
        ({"times": (math.nan,)}, "times: expected a finite number"),
        ({"times": (1e9,)}, "times: .* at most 1,000,000"),
        ({"step": 0.0}, "step: expected positive"),
        ({"friction": -0.1}, "friction: expected zero or more"),
        ({"resolution": 1}, "resolution: expected 2 to 1024"),
        ({"contact": -1.0}, "contact: expected positive"),
    ],
)
def test_bad_arguments_are_named(lite, bad, message):
    with pytest.raises(ValueError, match=message):
        simulate(ip.body.posed(lite, "squat"), lite.template, FLOOR, **bad)


@pytest.mark.parametrize(("engine", "module"), [("bullet", "pybullet"), ("mujoco", "mujoco")])
def test_an_engine_that_is_not_installed_names_its_extra(lite, monkeypatch, engine, module):
    monkeypatch.setitem(sys.modules, module, None)
    monkeypatch.delitem(sys.modules, f"ipman_rs.simulation.{engine}_engine", raising=False)
    with pytest.raises(ImportError, match=rf"pip install 'ipman_rs\[{engine}\]'"):
        simulate(ip.body.posed(lite, "squat"), lite.template, FLOOR, engine=engine)
