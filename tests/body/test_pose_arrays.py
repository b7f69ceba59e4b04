"""Rotations in files, in every form in which they are written, against scipy's rotations."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import ipman_rs as ip
from ipman_rs.body import joints, pose_arrays


def turns(frames, count, seed=0):
    vectors = 0.5 * np.random.default_rng(seed).normal(size=(frames, count, 3))
    return vectors, Rotation.from_rotvec(vectors.reshape(-1, 3)).as_matrix().reshape(frames, count, 3, 3)


def pieces(**arrays):
    return pose_arrays.read(lambda *names: next((np.asarray(arrays[name]) for name in names if name in arrays), None))


FORMS = {
    "(T, n, 3, 3)": lambda m: m,
    "(T, n, 9)": lambda m: m.reshape(*m.shape[:2], 9),
    "(T, 9 n)": lambda m: m.reshape(len(m), -1),
    "(T, n, 6)": lambda m: np.concatenate([m[..., 0], m[..., 1]], axis=-1),
    "(T, 6 n)": lambda m: np.concatenate([m[..., 0], m[..., 1]], axis=-1).reshape(len(m), -1),
    "SPIN's (T, n, 3, 2)": lambda m: m[..., :2],
    "SPIN's (T, 6 n)": lambda m: m[..., :2].reshape(len(m), -1),
}


@pytest.mark.parametrize("form", FORMS)
@pytest.mark.parametrize("frames", [1, 4])
@pytest.mark.parametrize(
    ("name", "count"), [("body_pose", 23), ("body_pose", 21), ("poses", 24), ("pose", 55), ("left_hand_pose", 15)]
)
def test_matrices_and_two_columns(form, frames, name, count):
    vectors, matrices = turns(frames, count)
    (piece,) = pieces(**{name: FORMS[form](matrices)})
    np.testing.assert_allclose(piece.rotations, vectors, atol=1e-12)
    assert len(piece.joints) == count
    assert piece.is_absolute


@pytest.mark.parametrize("shape", [(3, 3), (1, 3, 3), (1, 1, 3, 3), (9,), (1, 9)])
@pytest.mark.parametrize("body", [{}, {"body_pose": np.zeros((1, 69))}, {"body_pose": np.zeros((5, 63))}])
def test_a_root_that_is_one_matrix(shape, body):
    vectors, matrices = turns(1, 1)
    root, *_ = pieces(global_orient=matrices.reshape(shape), **body)
    np.testing.assert_allclose(root.rotations, vectors, atol=1e-12)
    assert root.form == "rotation matrices"


@pytest.mark.parametrize("shape", [(4, 3, 3), (4, 1, 3, 3), (4, 9)])
def test_a_root_that_is_a_matrix_in_each_frame(shape):
    vectors, matrices = turns(4, 1)
    root, _ = pieces(root_orient=matrices.reshape(shape), pose_body=np.zeros((4, 63)))
    np.testing.assert_allclose(root.rotations, vectors, atol=1e-12)


def test_three_frames_of_vectors_stay_vectors():
    vectors, _ = turns(3, 1)
    for root in (vectors[:, 0], vectors):
        first, _ = pieces(global_orient=root, body_pose=np.zeros((3, 63)))
        np.testing.assert_array_equal(first.rotations, vectors)
    first, _ = pieces(global_orient=vectors[:, 0], body_pose=np.zeros((1, 63)))
    np.testing.assert_array_equal(first.rotations, vectors)


def test_what_does_not_tell_is_refused():
    with pytest.raises(ValueError, match=r"global_orient has shape \(3, 3\): it may be one rotation matrix or three"):
        pieces(global_orient=np.eye(3), body_pose=np.zeros((3, 69)))
    with pytest.raises(ValueError, match=r"has shape \(3, 3\) and is nearly a rotation matrix, off by 0.02"):
        pieces(global_orient=1.01 * np.eye(3), body_pose=np.zeros((1, 69)))
    with pytest.raises(ValueError, match="global_orient: has the shape of rotation matrices, but they are none"):
        pieces(global_orient=np.diag([1.0, 1.0, -1.0])[None], body_pose=np.zeros((1, 69)))
    with pytest.raises(ValueError, match="whether w is first or last: call the array poses_wxyz or poses_xyzw"):
        pieces(poses=np.zeros((2, 24, 4)))
    with pytest.raises(ValueError, match="body_pose: has six numbers for each joint, but they are no two columns"):
        pieces(body_pose=np.ones((2, 21, 6)))
    with pytest.raises(ValueError, match="expected quaternions of length 1"):
        pieces(poses_xyzw=np.zeros((2, 24, 4)))
    with pytest.raises(ValueError, match=r"the pose has shape|poses has shape \(4, 71\); expected"):
        pieces(poses=np.zeros((4, 71)))


@pytest.mark.parametrize("ending", ["_wxyz", "_xyzw", "_quat_wxyz", "_quat_xyzw"])
def test_quaternions_whose_name_says_their_order(ending):
    vectors, matrices = turns(3, 22)
    given = Rotation.from_matrix(matrices.reshape(-1, 3, 3)).as_quat().reshape(3, 22, 4)
    given = given[..., [3, 0, 1, 2]] if ending.endswith("wxyz") else given
    (piece,) = pieces(**{f"poses{ending}": given})
    np.testing.assert_allclose(piece.rotations, vectors, atol=1e-12)


def test_frames_that_are_not_numbers_stay_so():
    vectors, matrices = turns(3, 24)
    matrices[1, 5, 0, 2] = np.nan
    (piece,) = pieces(pose=matrices)
    assert np.isnan(piece.rotations[1, 5]).all()
    assert np.isnan(piece.rotations).sum() == 3
    np.testing.assert_allclose(piece.rotations[2], vectors[2], atol=1e-12)


def test_fingers_as_matrices_are_not_relative_to_the_mean_hand():
    vectors, matrices = turns(2, 15)
    mean = np.random.default_rng(3).normal(size=(55, 3))
    (piece,) = pieces(right_hand_pose=matrices)
    pose = pose_arrays.place([piece], joints.SMPLX, 2, mean)
    hands = [joints.SMPLX.index(name) for name in joints.RIGHT_HAND]
    np.testing.assert_allclose(pose[:, hands] + mean[hands], vectors, atol=1e-12)
    (piece,) = pieces(right_hand_pose=vectors)
    np.testing.assert_array_equal(pose_arrays.place([piece], joints.SMPLX, 2, mean)[:, hands], vectors)


def test_degrees_are_of_vectors():
    vectors, matrices = turns(2, 23)
    arrays = {"global_orient": np.degrees(vectors[:, :1]), "body_pose": matrices}
    root, body = pose_arrays.read(lambda *names: arrays.get(names[0]), degrees=True)
    np.testing.assert_allclose(root.rotations, vectors[:, :1], atol=1e-12)
    np.testing.assert_allclose(body.rotations, vectors, atol=1e-12)


@pytest.mark.parametrize("columns", [72, 69])
def test_the_turn_that_easymocap_has_beside_its_poses(columns):
    """The whole body is turned by Rh after all else: the root's rotation is Rh times its own."""
    body = ip.load_body("anny-lite")
    vectors, _ = turns(3, 24)
    turn, _ = turns(3, 1, seed=1)
    if columns == 69:
        vectors[:, 0] = 0
    read = pieces(poses=vectors.reshape(3, 72)[:, 72 - columns :], Rh=turn[:, 0])
    turned = body(pose_arrays.place(read, body.joint_names, 3)).vertices
    pelvis = body().joints[0]
    outer = Rotation.from_rotvec(turn[:, 0]).as_matrix()
    expected = (body(vectors).vertices - pelvis) @ outer.swapaxes(1, 2) + pelvis
    np.testing.assert_allclose(turned, expected, atol=1e-12)


@pytest.mark.parametrize("count", [24, 52, 55])
def test_the_pieces_of_a_pose_are_those_of_the_smplx_package(lifelike_arrays, tmp_path, count):
    """Their joints as the package has them, 0 the pelvis; and a pose comes back from its pieces."""
    path = tmp_path / "model.npz"
    np.savez(path, **lifelike_arrays(count))
    body = ip.load_body(path)
    pose = np.random.default_rng(count).normal(size=(2, count, 3))
    found = pose_arrays.split(pose, body)
    fingers = {24: None, 52: 22, 55: 25}[count]
    expected = {"global_orient": (0, 1), "body_pose": (1, 24 if count == 24 else 22)}
    if count == 55:
        expected |= {"jaw_pose": (22, 23), "leye_pose": (23, 24), "reye_pose": (24, 25)}
    if fingers is not None:
        hands = {"left_hand_pose": (fingers, fingers + 15), "right_hand_pose": (fingers + 15, fingers + 30)}
        expected |= hands
    assert list(found) == list(expected)
    for name, (first, last) in expected.items():
        np.testing.assert_array_equal(found[name], pose[:, first:last].reshape(2, -1))
    one = {f"before_{name}": array[1:] for name, array in found.items()}
    np.testing.assert_array_equal(pose_arrays.joined(one, body, "before_"), pose[1])
    with pytest.raises(ValueError, match="before_body_pose: expected"):
        pose_arrays.joined({**one, "before_body_pose": np.zeros(5)}, body, "before_")
