"""3DPW: sequence files as Python 2 pickled them, and SPIN's file."""

from __future__ import annotations

import pickle

import numpy as np
import pytest

import ipman_rs.data as data
from tests.helpers.miniatures import threedpw


def test_sequence_files(tmp_path):
    threedpw.write(tmp_path, sequence="downtown_arguing_00")
    threedpw.write(tmp_path, sequence="office_phoneCall_00", people=1, invalid=())
    frames = data.open("3dpw", tmp_path)[:]
    arguing = [f"downtown_arguing_00/image_{frame:05d}" for frame in range(5)]
    first = [name for name in arguing if name[-1] != "2"]  # its camera is not aligned there
    phone = [f"office_phoneCall_00/image_{frame:05d}" for frame in range(5)]
    assert frames.names.tolist() == [*first, *(f"{name}#1" for name in arguing), *phone]
    assert frames.sequences.tolist() == 4 * ["downtown_arguing_00"] + 5 * ["downtown_arguing_00#1"] + 5 * [
        phone[0][:19]
    ]
    assert frames.genders.tolist() == 4 * ["male"] + 5 * ["female"] + 5 * ["male"]
    assert frames.images[4] == "imageFiles/downtown_arguing_00/image_00000.jpg"
    assert frames.frame_rate == 30
    assert frames.ground is None
    assert frames.pose.shape == (14, 24, 3)
    np.testing.assert_array_equal(frames.betas, np.tile(np.linspace(-1, 1, 10), (14, 1)))


def test_camera_sees_the_joints_where_they_are_labelled(tmp_path):
    """In plain loops: X_c = cam_pose X, x = K X_c / z."""
    _, made = threedpw.write(tmp_path, invalid=())
    frames = data.open("3dpw", tmp_path)[:]
    shared = [name for name in frames.joint_names if name in frames.keypoint_names]
    assert len(shared) == 13
    for f in range(len(frames)):
        extrinsics, intrinsics = made["cam_poses"][f % 5], made["cam_intrinsics"]
        for name in shared:
            point = [*frames.joints[f, list(frames.joint_names).index(name)], 1.0]
            seen = [sum(extrinsics[i][j] * point[j] for j in range(4)) for i in range(3)]
            image = [sum(intrinsics[i][j] * seen[j] for j in range(3)) for i in range(3)]
            labelled = frames.keypoints[f, list(frames.keypoint_names).index(name)]
            np.testing.assert_allclose([image[0] / image[2], image[1] / image[2]], labelled[:2], atol=1e-8)
        # and the data set's camera is that one
        camera = frames[np.array([f])].cameras
        np.testing.assert_allclose(camera.rotation[0] @ point[:3] + camera.translation[0], seen, atol=1e-12)


def test_spins_file(tmp_path):
    file, _ = threedpw.write_npz(tmp_path)
    for place in (file, tmp_path):
        frames = data.open("3dpw", place)[:]
        names = [f"downtown_arguing_00/image_{frame:05d}" for frame in range(4)]
        assert frames.names.tolist() == [*names, *(f"{name}#1" for name in names)]
        assert frames.sequences.tolist() == 4 * ["downtown_arguing_00"] + 4 * ["downtown_arguing_00#1"]
        assert frames.genders.tolist() == 4 * ["male"] + 4 * ["female"]
        assert frames.frame_rate == 30
        assert frames.transl is None


class Runs:
    """Would create a file when unpickled."""

    def __init__(self, path):
        self.path = path

    def __reduce__(self):
        return open, (str(self.path), "w")


@pytest.mark.parametrize("protocol", [0, 2, 5])
def test_hostile_pickle_is_not_run(tmp_path, protocol):
    victim = tmp_path / "victim"
    file, made = threedpw.write(tmp_path)
    file.write_bytes(pickle.dumps(made | {"sequence": Runs(victim)}, protocol))
    with pytest.raises(
        ValueError, match=r"names (io|_io|__builtin__)\.open, which no sequence of 3DPW needs"
    ) as caught:
        data.open("3dpw", file)
    assert str(file) in str(caught.value)
    assert not victim.exists()


def changed(**changes):
    def change(content):
        for name, value in changes.items():
            content[name] = value(content[name])

    return change


def without(name):
    return lambda content: content.pop(name)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (without("campose_valid"), "no campose_valid in it; is it a sequence file of 3DPW"),
        (changed(poses=lambda p: [each[:4] for each in p]), r"poses\[0\]: expected numbers of shape \(5, 72\), got"),
        (changed(trans=lambda t: t[:1]), r"trans: expected a list with an entry a person, as many as in poses \(2\)"),
        (changed(genders=lambda _: ["m", "x"]), r"genders\[1\]: expected 'm' or 'f', got 'x'"),
        (changed(poses=lambda p: [each.astype(object) for each in p]), r"poses\[0\]: array of Python objects"),
        (changed(jointPositions=lambda j: [each * 1000 for each in j]), "joints: looks like millimetres"),
        (changed(cam_poses=np.linalg.inv), "joints (lie behind the camera|seen through the camera lie)"),
        (changed(poses=np.degrees), "pose: looks like degrees"),
    ],
)  # fmt: skip
def test_bad_content(tmp_path, change, message):
    if "degrees" in message:
        change = changed(poses=lambda poses: [np.degrees(each) + 90 for each in poses])
    file, _ = threedpw.write(tmp_path, change=change)
    with pytest.raises(ValueError, match=message) as caught:
        data.open("3dpw", file)
    assert str(file) in str(caught.value)


def test_half_a_file(tmp_path):
    file, _ = threedpw.write(tmp_path)
    file.write_bytes(file.read_bytes()[:5000])
    with pytest.raises(ValueError, match="cannot be read as a pickled sequence of 3DPW"):
        data.open("3dpw", tmp_path)


def test_nothing_there(tmp_path):
    with pytest.raises(ValueError, match=r"no sequenceFiles/test/\*\.pkl and no 3dpw_test\.npz in it"):
        data.open("3dpw", tmp_path)
    with pytest.raises(ValueError, match="split: expected one of test, validation, train, got 'val'"):
        data.open("3dpw", tmp_path, split="val")
