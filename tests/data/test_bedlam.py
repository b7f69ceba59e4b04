"""BEDLAM's scenes, on miniature files written from the project's own description."""

from __future__ import annotations

import numpy as np
import pytest

import ipman_rs.data as data
from ipman_rs.body import joints
from tests.helpers.miniatures import bedlam, spin


def test_scene(tmp_path):
    file, truth = bedlam.write(tmp_path)
    frames = data.open("bedlam", file)[:]
    assert frames.names.tolist() == truth["names"]
    assert frames.sequences.tolist() == 4 * [f"{file.stem}/seq_000000"] + 4 * [f"{file.stem}/seq_000000#1"]
    assert frames.frame_rate == 6.0  # every fifth image of 30 Hz
    assert frames.body == "smplx"
    assert frames.pose.shape == (8, 55, 3)
    assert frames.genders.tolist() == 8 * ["neutral"]  # 11 betas are the neutral model's
    assert frames.ground is None
    assert frames.keypoint_names == joints.SMPLX


def test_world_to_camera(tmp_path):
    """In plain loops: the joints of the world, through cam_ext and cam_int, fall on gtkps."""
    file, truth = bedlam.write(tmp_path)
    frames = data.open("bedlam", file)[:]
    for f, points in enumerate(truth["joints"]):
        for name, point in zip(bedlam.NAMED, points, strict=True):
            rotation, translation = frames.cameras.rotation[f], frames.cameras.translation[f]
            seen = [sum(rotation[i][j] * point[j] for j in range(3)) + translation[i] for i in range(3)]
            image = [sum(frames.cameras.intrinsics[f][i][j] * seen[j] for j in range(3)) for i in range(3)]
            labelled = frames.keypoints[f, frames.keypoint_names.index(name), :2]
            np.testing.assert_allclose([image[0] / image[2], image[1] / image[2]], labelled, atol=1e-8)


def test_up_is_minus_y(tmp_path):
    file, truth = bedlam.write(tmp_path)
    frames = data.open("bedlam", file, height=0.0)[:]
    np.testing.assert_array_equal(frames.ground.normal, (0, -1, 0))
    np.testing.assert_allclose(
        frames.ground.signed_height(np.array(truth["joints"]))[:, 7:], 0.08, atol=1e-12
    )  # ankles


def test_smpl_and_bedlam2(tmp_path):
    file, _ = bedlam.write(tmp_path, columns=72, shape=np.zeros((8, 10)))
    frames = data.open("bedlam", file)[:]
    assert frames.body == "smpl"
    assert frames.genders.tolist() == 8 * ["female"]
    assert len(frames.keypoint_names) == 24
    file, _ = bedlam.write(tmp_path, shape=np.zeros((8, 16)), hand_det_conf=np.ones((8, 2)))
    frames = data.open("bedlam", file)[:]
    assert frames.keypoint_names[0] == "openpose_nose"
    assert frames.keypoints.shape == (8, 25, 3)


def test_folder_of_scenes(tmp_path):
    bedlam.write(tmp_path, "a_6fps.npz", frames=3)
    bedlam.write(tmp_path, "b_6fps.npz", frames=2, people=1, shape=np.zeros((2, 10)))
    frames = data.open("bedlam", tmp_path)
    assert len(frames) == 8
    every = frames[:]
    assert [name.partition("/")[0] for name in every.names] == 6 * ["a_6fps"] + 2 * ["b_6fps"]
    assert every.betas.shape == (8, 11)
    np.testing.assert_array_equal(every.betas[6:], 0)
    mixed = frames[np.array([7, 0, 6, 1, -1])]
    assert mixed.names.tolist() == every.names[[7, 0, 6, 1, 7]].tolist()
    np.testing.assert_array_equal(mixed.cameras.translation, every.cameras.translation[[7, 0, 6, 1, 7]])
    assert len(frames[5:7]) == 2
    assert len(frames[8:]) == 0
    with pytest.raises(IndexError, match="expected numbers from 0 to 7"):
        frames[np.array([8])]


def turned_up(values):
    """y down into y up."""
    return values * (1, -1, -1)


def spoilt(**changes):
    def make(folder):
        file, _ = bedlam.write(folder)
        with np.load(file, allow_pickle=True) as arrays:
            given = dict(arrays)
        return spin.save(file, given, {name: change(given[name]) for name, change in changes.items()})

    return make


def y_up(folder):
    file, _ = bedlam.write(folder)
    with np.load(file, allow_pickle=True) as arrays:
        given = dict(arrays)
    given["pose_world"][:, :3] = 0  # SMPL-X at rest stands along +y
    return spin.save(file, given)


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (y_up, r"pose: looks like \+y up: .* up is said to be \(0, -1, 0\)"),
        (spoilt(trans_world=lambda t: t * 1000), "transl: looks like millimetres"),
        (spoilt(cam_ext=lambda e: None), "no cam_ext among its arrays"),
        (spoilt(pose_world=lambda p: p[:, :66]), r"pose_world: expected 165 columns \(SMPL-X\) or 72 \(SMPL\), got 66"),
        (spoilt(cam_int=lambda k: k[:-1]), "cam_int: expected 8 rows, as imgname has, got 7"),
        (spoilt(cam_ext=lambda e: e * 2), "cameras.rotation: 8 of 8 are no rotations"),
    ],
)  # fmt: skip
def test_bad_files(tmp_path, make, message):
    file = make(tmp_path)
    with pytest.raises(ValueError, match=message) as caught:
        data.open("bedlam", tmp_path)
    assert str(file) in str(caught.value)


def test_no_scene(tmp_path):
    with pytest.raises(ValueError, match=r"no \.npz file in it"):
        data.open("bedlam", tmp_path)
    with pytest.raises(ValueError, match="no such file or folder"):
        data.open("bedlam", tmp_path / "nowhere")
