"""The body model in numpy: against a plain loop, batches, dtypes, poses in both forms, bad arguments."""

from __future__ import annotations

import subprocess
import sys

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import ipman_rs as ip
from ipman_rs.body import rotations


@pytest.fixture(scope="module")
def body():
    return ip.load_body("anny-lite")


@pytest.fixture
def rng():
    return np.random.default_rng(0)


def skinned_by_the_book(body, pose, betas):
    """Linear blend skinning of one body with 4 x 4 matrices, a vertex and a joint at a time."""
    rest = body.v_template + body.shapedirs @ betas
    joints = body.J_template + body.J_shapedirs @ betas
    world, joint_world = [], []
    for j, parent in enumerate(body.parents):
        local = np.eye(4)
        local[:3, :3] = Rotation.from_rotvec(pose[j]).as_matrix()
        if parent < 0:
            local[:3, 3] = joints[j]
            world.append(local)
        else:
            local[:3, 3] = body.rest_rotation[parent] @ (joints[j] - joints[parent])
            world.append(world[parent] @ local)
        turned = world[j].copy()
        turned[:3, :3] = turned[:3, :3] @ body.rest_rotation[j]
        back = np.eye(4)
        back[:3, 3] = -joints[j]
        joint_world.append(turned @ back)
    vertices = np.zeros_like(rest)
    for v in range(0, len(rest), 50):  # every fiftieth is enough
        vertices[v] = sum(body.weights[v, j] * (joint_world[j] @ [*rest[v], 1])[:3] for j in range(body.num_joints))
    return vertices[::50], np.array([matrix[:3, 3] for matrix in world])


def test_against_a_plain_loop(body, rng):
    pose, betas = rng.normal(size=(24, 3)), rng.normal(size=10)
    vertices, joints = skinned_by_the_book(body, pose, betas)
    output = body(pose, betas)
    np.testing.assert_allclose(output.vertices[::50], vertices, atol=1e-13)
    np.testing.assert_allclose(output.joints, joints, atol=1e-13)


def test_six_numbers_and_three_give_the_same_body(body, rng):
    pose = rng.normal(size=(2, 24, 3))
    six = rotations.to_6d(Rotation.from_rotvec(pose.reshape(-1, 3)).as_matrix()).reshape(2, 24, 6)
    np.testing.assert_allclose(body(six).vertices, body(pose).vertices, atol=1e-13)


def test_six_numbers_are_the_first_two_columns():
    """(Zhou et al. 2019, eq. 15); any scale of the columns and any share of the first in the second is taken out."""
    matrix = Rotation.from_euler("xyz", [10, 20, 30], degrees=True).as_matrix()
    loose = np.concatenate([3 * matrix[:, 0], 2 * matrix[:, 1] + 5 * matrix[:, 0]])
    np.testing.assert_allclose(rotations.from_6d(loose), matrix, atol=1e-15)


def test_axis_angle_near_zero_and_half_turn(rng):
    for angle in (0.0, 1e-300, 1e-9, 1e-4, 1.0, np.pi - 1e-9, np.pi, 7.0):
        vector = angle * np.array([0.6, 0.0, 0.8])
        np.testing.assert_allclose(
            rotations.from_axis_angle(vector), Rotation.from_rotvec(vector).as_matrix(), atol=1e-15
        )


@pytest.mark.parametrize("batch", [(), (3,), (2, 3), (0,), (2, 0, 3), (130,)])  # 130 bodies: more than one piece
def test_batches(body, rng, batch):
    pose, betas, transl = (rng.normal(size=(*batch, *tail)) for tail in ((24, 3), (10,), (3,)))
    output = body(pose, betas, transl)
    assert output.vertices.shape == (*batch, 1229, 3)
    assert output.joints.shape == (*batch, 24, 3)
    for index in list(np.ndindex(batch))[::37]:
        one = body(pose[index], betas[index], transl[index])
        np.testing.assert_allclose(output.vertices[index], one.vertices, atol=1e-13)


def test_arguments_broadcast(body, rng):
    pose, betas, transl = rng.normal(size=(5, 1, 24, 3)), rng.normal(size=(4, 10)), rng.normal(size=3)
    output = body(pose, betas, transl)
    assert output.vertices.shape == (5, 4, 1229, 3)
    np.testing.assert_allclose(output.vertices[2, 3], body(pose[2, 0], betas[3], transl).vertices, atol=1e-13)
    np.testing.assert_allclose(output.joints, body(pose, betas).joints + transl, atol=1e-13)


def test_missing_components_are_zero(body):
    np.testing.assert_array_equal(body(betas=[1.0, 2.0]).vertices, body(betas=[1.0, 2.0] + 8 * [0.0]).vertices)
    np.testing.assert_array_equal(body().vertices, body(np.zeros((24, 3)), np.zeros(10), np.zeros(3)).vertices)


def test_dtype_of_input_is_dtype_of_output(body, rng):
    pose, betas = rng.normal(size=(24, 3)), rng.normal(size=10)
    single = body(pose.astype(np.float32), betas.astype(np.float32))
    assert single.vertices.dtype == single.joints.dtype == np.float32
    np.testing.assert_allclose(single.vertices, body(pose, betas).vertices, atol=1e-6)  # rounding of the arguments
    assert body(pose.astype(np.float32), betas).vertices.dtype == np.float64
    assert body(np.zeros((24, 3), int)).vertices.dtype == np.float64
    assert body(pose.tolist()).vertices.dtype == np.float64


def test_a_nan_stays_in_its_body(body, rng):
    pose = rng.normal(size=(3, 24, 3))
    clean = body(pose).vertices
    pose[1, 4] = np.nan
    spoilt = body(pose).vertices
    np.testing.assert_array_equal(spoilt[[0, 2]], clean[[0, 2]])
    assert np.isnan(spoilt[1]).any()


@pytest.mark.parametrize(
    ("arguments", "match"),
    [
        (
            {"pose": np.zeros(72)},
            r"pose: expected \(..., 24, 3\) axis-angle or .* got shape \(72,\); reshape a flat pose",
        ),
        ({"pose": np.zeros((24, 4))}, "pose: expected"),
        ({"pose": np.zeros((23, 3))}, "pose: expected"),
        ({"betas": np.zeros(11)}, r"betas: expected shape \(..., up to 10\), got \(11,\)"),
        ({"betas": 1.0}, "betas: expected"),
        ({"transl": np.zeros(2)}, r"transl: expected shape \(..., 3\), got \(2,\)"),
        ({"expression": np.zeros(1)}, "expression: expected"),
        ({"pose": np.zeros((2, 24, 3)), "betas": np.zeros((3, 10))}, r"do not fit together: pose \(2,\), betas \(3,\)"),
    ],
)
def test_bad_arguments(body, arguments, match):
    with pytest.raises(ValueError, match=match):
        body(**arguments)


def test_import_loads_neither_scipy_nor_torch():
    code = "import sys, ipman_rs.body as b; b.load_body('anny-lite')(); print({'scipy', 'torch'} & set(sys.modules))"
    assert subprocess.run([sys.executable, "-c", code], capture_output=True, text=True).stdout.strip() == "set()"
