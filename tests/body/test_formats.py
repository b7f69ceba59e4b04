"""Kinds of body models side by side, with as many joints as each other."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

import ipman_rs as ip
from ipman_rs.body import formats, joints, pose_arrays
from ipman_rs.body.formats import FORMATS
from ipman_rs.files.errors import FileError
from ipman_rs.io.parameters import read_npz

# A kind with SMPL-X's 55 joints of which the last 30 are others, in files with the arrays of SMPL-X and one more.
CLAWS = (*joints.SMPLX[:25], *(f"claw{number}" for number in range(30)))
SMPLX = FORMATS["smplx"]


def load(file, **options):
    return dataclasses.replace(SMPLX.load(file, **options), kind="claws", joint_names=CLAWS)


@pytest.fixture
def kinds(monkeypatch, lifelike_arrays, tmp_path):
    """Files of two kinds of models with 55 joints: {"smplx": path, "claws": path}."""
    arrays = lifelike_arrays(55)
    np.savez(tmp_path / "people.npz", **arrays)
    np.savez(tmp_path / "birds.npz", **arrays, claws=np.ones(1))
    claws = dataclasses.replace(
        SMPLX,
        name="claws",
        title="Claws",
        joints=CLAWS,
        matches=lambda file: "claws" in file.keys,
        load=load,
        written=("pose",),
        pieces={},
        poses=(CLAWS,),
    )
    without = dataclasses.replace(SMPLX, matches=lambda file: "claws" not in file.keys and SMPLX.matches(file))
    monkeypatch.setitem(FORMATS, "smplx", without)
    monkeypatch.setitem(FORMATS, "claws", claws)
    return {"smplx": tmp_path / "people.npz", "claws": tmp_path / "birds.npz"}


def test_each_file_is_of_its_kind(kinds):
    for kind, path in kinds.items():
        body = ip.load_body(path)
        assert body.kind == kind
        assert body.joint_names == FORMATS[kind].joints


def test_a_file_of_two_kinds_is_refused(kinds, monkeypatch):
    monkeypatch.setitem(FORMATS, "smplx", SMPLX)
    with pytest.raises(ValueError, match=r"birds.npz: may be a model of SMPL-X or of Claws; nothing in it tells which"):
        ip.load_body(kinds["claws"])


def test_a_pose_of_so_many_joints_is_that_of_the_body(kinds, tmp_path):
    """The 165 columns of poses that name no model turn the joints of the body that is posed."""
    pose = np.zeros((1, 55, 3), np.float32)
    pose[0, 40] = 0.5  # a finger of SMPL-X, a claw of the other
    np.savez(tmp_path / "poses.npz", pose=pose.reshape(1, -1))
    for path in kinds.values():
        body = ip.load_body(path)
        found = read_npz(tmp_path / "poses.npz", str(path))
        np.testing.assert_allclose(found.vertices[0], body(pose[0]).vertices, atol=1e-6)  # float32 metres


def test_what_the_file_says_counts_before_the_body(kinds, tmp_path):
    pose = np.zeros((1, 55, 3), np.float32)
    pose[0, 40] = 0.5
    np.savez(tmp_path / "poses.npz", pose=pose.reshape(1, -1), model_type="smplx")
    body = ip.load_body(kinds["claws"])
    found = read_npz(tmp_path / "poses.npz", str(kinds["claws"]))
    np.testing.assert_allclose(found.vertices[0], body().vertices, atol=1e-6)  # it has no such finger


def test_a_pose_that_may_be_of_two_kinds_is_refused(kinds, tmp_path):
    np.savez(tmp_path / "poses.npz", pose=np.zeros((1, 165)))
    said = "as poses of SMPL-X and Claws have, and nothing tells of which model it is: name it in an array model"
    with pytest.raises(FileError, match=said):
        read_npz(tmp_path / "poses.npz", "anny-lite")
    with pytest.raises(ValueError, match="has 55 joints, as SMPL-X and Claws have; say of which model it is"):
        formats.joints_of_pose(55, ip.load_body("anny-lite"))


def test_poses_are_written_and_read_by_each_kind(kinds):
    pose = np.random.default_rng(0).normal(size=(1, 55, 3))
    for kind, path in kinds.items():
        body = ip.load_body(path)
        arrays = pose_arrays.split(pose, body)
        assert ("pose" in arrays) == (kind == "claws")
        np.testing.assert_array_equal(pose_arrays.joined(arrays, body), pose[0])


def test_a_shorter_pose_is_put_on_joints_by_their_names(lifelike_arrays, tmp_path):
    """SMPL+H's fingers are SMPL-X's, after jaw and eyes."""
    np.savez(tmp_path / "x.npz", **lifelike_arrays(55))
    body = ip.load_body(tmp_path / "x.npz")
    pose = np.random.default_rng(0).normal(size=(2, 52, 3))
    found = formats.on_joints(pose, body)
    np.testing.assert_array_equal(found[:, 22:25], 0)
    np.testing.assert_array_equal(np.delete(found, [22, 23, 24], axis=1), pose)
