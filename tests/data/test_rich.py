"""RICH: bodies in camera 0's axes, the scan's ground in them, cameras, splits; and what can be wrong with its files."""

from __future__ import annotations

import json
import pickle

import numpy as np
import pytest

import ipman_rs.data as data
from ipman_rs.body.hands import Hands
from ipman_rs.data import rich
from tests.helpers.miniatures import rich as miniature

ONE = "Pavallion_018_yoga1"


@pytest.fixture(scope="module")
def whole(tmp_path_factory):
    root = tmp_path_factory.mktemp("RICH")
    return root, miniature.write(root)


@pytest.fixture
def one(tmp_path):
    truth = miniature.sequence(tmp_path, ONE, "val")
    miniature.scene(tmp_path, "Pavallion")
    return tmp_path, truth


def refused(root, match):
    """Reading raises, and `check` tells the same."""
    with pytest.raises(ValueError, match=match) as caught:
        data.open("rich", root)[:]
    wrong = [each.what for each in rich.check(root) if each.level == "wrong"]
    assert any(str(caught.value).startswith(what) for what in wrong), wrong


def test_the_miniature_in_the_common_form(whole):
    root, truth = whole
    found = data.open("rich", root)
    frames = found[:]
    assert len(found) == 8 * 3
    assert frames.body == "smplx"
    assert frames.pose.shape == (24, 55, 3)
    assert frames.frame_rate == 30
    assert len(np.unique(frames.names)) == 24
    rows = frames.sequences == f"{ONE}/00"
    assert frames.names[rows].tolist() == [f"{ONE}/{frame:05d}_00" for frame in (5, 6, 7)]
    for row, ((_, frame), content) in zip(np.flatnonzero(rows), truth[ONE].items(), strict=True):
        pose = frames.pose[row]
        np.testing.assert_array_equal(pose[0], content["global_orient"][0])
        np.testing.assert_array_equal(pose[1:22].ravel(), content["body_pose"][0])
        np.testing.assert_array_equal(pose[22], content["jaw_pose"][0])
        np.testing.assert_array_equal(pose[23:], 0)  # eyes, and fingers without their components
        np.testing.assert_array_equal(frames.transl[row], content["transl"][0])
        np.testing.assert_array_equal(frames.betas[row], content["betas"][0])
        assert frames.images[row].endswith(f"images/val/{ONE}/cam_00/{frame:05d}_00.jpeg")
    assert set(frames.genders[rows]) == {"female"}
    assert set(frames.genders[frames.sequences == "Pavallion_000_yoga1/00"]) == {"male"}
    np.testing.assert_array_equal(frames.cameras.rotation[0], np.eye(3))


def test_the_ground_is_that_of_the_scan(whole):
    """Points of the scan's ground, taken into camera 0's axes, have no height; and somebody 1 m above it has 1 m."""
    root, _ = whole
    points, normal = miniature.ground_points()
    for split, place in (("ipman-val", "Pavallion"), ("ipman-test", "ParkingLot1")):
        data_set = data.open("rich", root, split=split)
        frames = data_set[len(data_set) - 1 : len(data_set)]
        assert place in frames.names[0]
        ground = frames.ground
        inside = miniature.into_camera(points, place)
        np.testing.assert_allclose(ground.signed_height(inside[None] if ground.height.ndim else inside), 0, atol=1e-6)
        above = miniature.into_camera(points + 1.0 * normal, place)
        height = ground.signed_height(above[None] if ground.height.ndim else above)
        np.testing.assert_allclose(height, 1 / miniature.SCALE, atol=1e-6)


def test_splits_and_cameras(whole):
    root, _ = whole
    sequences = {split: data.open("rich", root, split=split)[:] for split in ("ipman-train", "ipman-val", "ipman-test")}
    assert set(sequences["ipman-val"].sequences) == {f"{name}/00" for name in miniature.YOGA}
    assert set(sequences["ipman-train"].sequences) == {f"{name}/{n:02d}" for name in miniature.YOGA for n in (1, 2)}
    assert set(sequences["ipman-test"].sequences) == {f"{name}/{n:02d}" for name in miniature.TEST for n in (0, 1, 2)}
    train = data.open("rich", root, split="train")[:]
    assert set(train.sequences) == {"Pavallion_000_yoga2/00", "Pavallion_013_yoga2/00"}
    second = data.open("rich", root, split="train", cameras=[2])[:]
    rotation, translation, intrinsics = miniature.camera(2)
    np.testing.assert_allclose(second.cameras.rotation[0], rotation, atol=1e-12)
    np.testing.assert_allclose(second.cameras.translation[0], translation, atol=1e-12)
    np.testing.assert_array_equal(second.cameras.intrinsics[0], intrinsics)
    np.testing.assert_array_equal(second.pose, train.pose)  # bodies stay in camera 0's axes
    assert second.images is None
    assert sequences["ipman-test"].images[0].endswith("_00.jpeg")
    assert sequences["ipman-train"].images is None
    with pytest.raises(ValueError, match="split: expected one of train, val, test, ipman-train, .* got 'all'"):
        data.open("rich", root, split="all")
    with pytest.raises(ValueError, match=r"007.xml: expected the calibration of camera 7, no such file"):
        data.open("rich", root, cameras=[7])


def test_check_of_what_is_whole(whole):
    findings = rich.check(whole[0])
    assert [each for each in findings if each.level != "ok"] == []
    told = [each.what for each in findings]
    assert "8 sequences (2 in train, 6 in val, 0 in test)" in told
    assert "ipman-test: all 4 sequences" in told


def test_hands_of_components(one, rng):
    root, truth = one
    hands = Hands(*(rng.normal(scale=0.1, size=size) for size in ((30, 3), (12, 45), (12, 45))))
    frames = data.open("rich", root, hands=hands)[:]
    content = truth["018", 5]
    left = content["left_hand_pose"][0] @ hands.left_components + hands.mean[:15].ravel()
    right = content["right_hand_pose"][0] @ hands.right_components + hands.mean[15:].ravel()
    np.testing.assert_allclose(frames.pose[0, 25:].ravel(), np.concatenate([left, right]), atol=1e-12)


def test_two_people_and_gaps(tmp_path):
    name = "LectureHall_009_021_reparingprojector1"
    miniature.sequence(tmp_path, name, "test", frames=(4, 6, 8), people=["009", "021"])
    frames = data.open("rich", tmp_path)[:]
    assert frames.names[[0, 3]].tolist() == [f"{name}/00004_00", f"{name}/00004_00#1"]
    assert frames.sequences[[0, 3]].tolist() == [f"{name}/00", f"{name}/00#1"]
    assert frames.frame_rate == 15
    assert frames.genders[[0, 3]].tolist() == ["female", "female"]
    assert frames.ground is None
    assert frames.cameras is None
    missing = [each.what for each in rich.check(tmp_path) if each.level == "missing"]
    assert f"{name}: no ground" in missing
    assert f"{name}: no cameras" in missing
    miniature.sequence(tmp_path, name, "test", frames=(4, 6, 9), people=["009", "021"])
    assert data.open("rich", tmp_path)[:].frame_rate is None


def test_scenes_of_which_some_have_no_ground(whole, tmp_path):
    miniature.sequence(tmp_path, ONE, "val")
    miniature.sequence(tmp_path, "ParkingLot1_005_pushup1", "val")
    miniature.scene(tmp_path, "Pavallion")
    with pytest.raises(ValueError, match="ground of ParkingLot1_005_pushup1: expected ground_mesh.ply, as other"):
        data.open("rich", tmp_path)
    findings = rich.check(tmp_path)
    assert [each for each in findings if each.level == "wrong"] == []
    assert any("ParkingLot1_005_pushup1: no ground" in each.what for each in findings if each.level == "missing")


def test_the_ground_beside_the_bodies(one):
    root, _ = one
    (root / "scan_calibration" / "Pavallion" / "ground_mesh.ply").rename(
        root / "bodies" / "val" / ONE / "ground_mesh.ply"
    )
    assert data.open("rich", root)[:].ground is not None


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"transl": None}, "no transl in it"),
        ({"body_pose": np.zeros((1, 69))}, r"body_pose: expected 63 numbers, got float64 of \(1, 69\)"),
        ({"betas": "ten"}, "betas: expected an array"),
        ({"global_orient": np.array([["a", "b", "c"]])}, "global_orient: expected 3 numbers, got <U1"),
    ],
)
def test_bodies_that_cannot_be(one, changes, message):
    root, _ = one
    miniature.body(root / "bodies" / "val" / ONE / "00006" / "018.pkl", "Pavallion", **changes)
    refused(root, f"00006/018.pkl: {message}")


def test_millimetres_instead_of_metres(one):
    root, _ = one
    miniature.sequence(root, ONE, "val", scale=1000.0)
    refused(root, rf"{ONE}: transl: looks like millimetres: [34][0-9]* from the origin")


def test_bodies_in_other_axes(tmp_path):
    """In the scan's world, but said to be in camera 0's: turned by what lies between them."""
    rotation = np.array(miniature.to_world("Pavallion")[0])
    for name in (*miniature.YOGA, *miniature.TEST[:2], "Pavallion_003_yoga1", "Pavallion_005_yoga1"):
        miniature.sequence(tmp_path, name, "val", up=tuple(rotation @ [0, 0, 1]))
    miniature.scene(tmp_path, "Pavallion")
    with pytest.raises(ValueError, match=r"pose: looks like .* up: heads lie that way"):
        data.open("rich", tmp_path)


def test_a_frame_of_nan(one):
    root, truth = one
    nothing = np.full((1, 3), np.nan)
    miniature.body(
        root / "bodies" / "val" / ONE / "00006" / "018.pkl", "Pavallion", transl=nothing, global_orient=nothing
    )
    frames = data.open("rich", root)[:]
    assert np.isnan(frames.transl[1]).all()
    np.testing.assert_array_equal(frames.transl[[0, 2], :], [truth["018", frame]["transl"][0] for frame in (5, 7)])


def test_grounds_that_cannot_be(one):
    root, _ = one
    mesh = root / "scan_calibration" / "Pavallion" / "ground_mesh.ply"
    miniature.ground(mesh, turn=[[1, 0, 0], [0, 0, 1], [0, -1, 0]])
    refused(root, "ground_mesh.ply: looks like y up: the ground leans 90° from the scan's z")
    miniature.ground(mesh, scale=1000.0)
    refused(root, "ground_mesh.ply: looks like millimetres: vertices up to 3000 from the origin")
    mesh.write_bytes(b"ply\nhalf")
    refused(root, "ground_mesh.ply: expected a mesh")


def test_ways_to_the_world_that_cannot_be(one):
    root, _ = one
    path = root / "multicam2world" / "Pavallion_multicam2world.json"
    said = json.loads(path.read_text())
    for change, message in (
        ({"c": 1000.0}, "c: looks like millimetres: expected a scale about 1"),
        ({"R": [[1, 0, 0], [0, 2, 0], [0, 0, 1]]}, r"R: expected a rotation \(3, 3\)"),
        ({"t": [1, 2]}, "expected R, t and c of the way to the scan's world"),
        ({"c": None}, "c: expected a scale about 1, metres to metres, got nan"),
    ):
        path.write_text(json.dumps(said | change))
        refused(root, f"Pavallion_multicam2world.json: {message}")
    path.write_text(json.dumps(said)[:30])
    refused(root, "Pavallion_multicam2world.json: is no JSON")
    path.unlink()
    refused(root, "Pavallion_multicam2world.json: there is no such file")


BOMB = '<!DOCTYPE b [<!ENTITY a "ha"><!ENTITY b "&a;&a;&a;&a;"><!ENTITY c "&b;&b;&b;&b;">]>\n'


def test_calibrations_that_cannot_be(one):
    root, _ = one
    path = root / "scan_calibration" / "Pavallion" / "calibration" / "001.xml"
    miniature.calibration(path, 1, scale=1000.0)
    refused(root, "001.xml: CameraMatrix: looks like millimetres")
    miniature.calibration(path, 1, doctype=BOMB)
    refused(root, r"001.xml: cannot be read as XML: has a document type \(DOCTYPE\)")
    miniature.calibration(path, 1, cut=300)
    refused(root, "001.xml: cannot be read as XML: .*; is the download complete")
    miniature.calibration(path, 1)
    path.write_text(path.read_text().replace("<data>\n    ", "<data>\n    2.0 "))
    refused(root, "001.xml: CameraMatrix: expected 12 finite numbers, got 13")
    path.write_text("<opencv_storage></opencv_storage>")
    refused(root, "001.xml: expected <CameraMatrix><data> with text in it")


class Runs:
    def __init__(self, victim):
        self.victim = victim

    def __reduce__(self):
        return exec, (f"open({str(self.victim)!r}, 'w')",)


def test_a_hostile_pickle(one):
    root, _ = one
    path = root / "bodies" / "val" / ONE / "00006" / "018.pkl"
    path.write_bytes(pickle.dumps({"transl": Runs(root / "victim")}))
    refused(root, r"018.pkl: cannot be read as a pickled body of RICH: the pickle names builtins.exec, .* refused")
    assert not (root / "victim").exists()


def test_half_written_and_missing_files(one, tmp_path):
    root, _ = one
    path = root / "bodies" / "val" / ONE / "00006" / "018.pkl"
    content = path.read_bytes()
    for size in (0, len(content) // 2):
        path.write_bytes(content[:size])
        refused(root, "00006/018.pkl: cannot be read as a pickled body of RICH")
    path.write_bytes(content)
    (root / "bodies" / "val" / "Pavallion_003_yoga1").mkdir()
    refused(root, "Pavallion_003_yoga1: expected bodies such as 00045/000.pkl, found none")
    with pytest.raises(ValueError, match="expected a folder with bodies/train, bodies/val or bodies/test in it"):
        data.open("rich", tmp_path / "nothing")
    assert rich.check(tmp_path / "nothing")[0].level == "missing"
    with pytest.raises(ValueError, match=r"ipman-test: expected bodies/\*/Pavallion_002_yoga1, there is none"):
        data.open("rich", root, split="ipman-test")
