"""The named poses: on the floor, touching it where they should, balanced or not as they are called."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial import ConvexHull

import ipman_rs as ip
from ipman_rs.body import joints, poses

trimesh = pytest.importorskip("trimesh")

# Joints whose skin comes within 5 cm of the floor; of these all and of all others none.
CONTACTS = {
    "standing": "foot ankle",
    "t_pose": "foot ankle",
    "a_pose": "foot ankle",
    "walking": "foot ankle",
    "one_leg": "left_foot left_ankle",
    "tree": "left_foot left_ankle",
    "warrior": "foot ankle",
    "lunge": "foot ankle",
    "chair": "foot ankle",
    "squat": "foot ankle",
    "lean_past_toes": "foot ankle",
    "kneeling": "foot ankle knee hip",  # the hip moves the skin down to the kneecap
    "all_fours": "foot ankle knee hip wrist hand",
    "plank": "foot ankle wrist hand",
    "push_up": "foot ankle elbow wrist hand",  # and the elbow that of the forearm
    "cobra": "foot ankle knee hip pelvis spine1 elbow wrist",
    "sitting": "ankle knee hip hand pelvis",
    "lying": "ankle knee hip wrist hand elbow shoulder neck head pelvis spine1 spine2 spine3",
}


@pytest.fixture(scope="module")
def body():
    return ip.load_body("anny")


def stands_on(body, vertices, joint):
    owned = body.weights.argmax(1) == body.joint_names.index(joint)
    return vertices[owned, 1].min() < 0.05


def expected_contacts(name):
    for word in CONTACTS[name].split():
        yield from [word] if word in joints.SMPL else [f"left_{word}", f"right_{word}"]


def margin(body, vertices, threshold):
    """Distance of the exact centre of mass to the hull of the vertices below `threshold`, from above; > 0 inside."""
    centre = trimesh.Trimesh(vertices, body.faces, process=False).center_mass[[0, 2]]
    hull = ConvexHull(vertices[vertices[:, 1] < threshold][:, [0, 2]])
    return -(hull.equations[:, :2] @ centre + hull.equations[:, 2]).max()


def test_there_is_a_library():
    assert set(CONTACTS) == set(poses.NAMES)
    with pytest.raises(ValueError, match="no pose 'flying'; there are standing, t_pose"):
        poses.pose("flying")


@pytest.mark.parametrize("name", poses.NAMES)
def test_pose_and_floor(body, name):
    pose = poses.pose(name)
    assert pose.shape == (24, 3)
    assert np.abs(pose[1:]).max() < np.radians(150)  # beyond what any joint does
    vertices = poses.posed(body, name)
    assert vertices[:, 1].min() == 0.0
    assert {joint for joint in joints.SMPL if stands_on(body, vertices, joint)} == set(expected_contacts(name))


@pytest.mark.parametrize("name", [name for name in poses.NAMES if name != "lean_past_toes"])
def test_balanced(body, name):
    vertices = poses.posed(body, name)
    assert margin(body, vertices, 0.03) > 0.02
    assert margin(body, vertices, 0.10) > 0.02


def test_out_of_balance(body):
    assert margin(body, poses.posed(body, "lean_past_toes"), 0.10) < -0.05


@pytest.mark.parametrize("name", poses.NAMES)
def test_every_body_is_fine_for_the_engine(name):
    for body in (ip.load_body("anny"), ip.load_body("anny-lite")):
        assert ip.body_status(poses.posed(body, name), body.template, ip.Ground.y_up()) == ip.Status.OK


def test_shapes_stand_on_the_floor_too(body):
    betas = np.random.default_rng(0).normal(size=(3, 10))
    vertices = poses.posed(body, "tree", betas)
    assert vertices.shape == (3, 12_272, 3)
    np.testing.assert_array_equal(vertices[..., 1].min(-1), 0.0)


def test_sides_mirror():
    """A pose without sides is symmetric: the right side's rotations are the left side's, mirrored."""
    pose = poses.pose("squat")
    for j, name in enumerate(joints.SMPL):
        if name.startswith("left_"):
            right = joints.SMPL.index(name.replace("left", "right"))
            np.testing.assert_allclose(pose[right], pose[j] * [1, -1, -1], atol=1e-12)
