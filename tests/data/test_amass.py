"""AMASS: motions of both releases, splits, rates, and what can be wrong with them."""

from __future__ import annotations

import pickle

import numpy as np
import pytest

import ipman_rs.data as data
from ipman_rs.data import amass
from ipman_rs.files import safe_npz
from tests.helpers.miniatures import amass as miniature


@pytest.mark.parametrize("kind", ["smplh", "smplx"])
def test_the_miniature_in_the_common_form(tmp_path, kind):
    written = miniature.tree(tmp_path, kind)
    found = data.open("amass", tmp_path)
    assert len(found) == sum(len(poses) for poses, _ in written.values())
    frames = found[:]
    assert frames.body == kind
    assert frames.frame_rate is None  # the files have 60 and 120 Hz
    np.testing.assert_array_equal(
        frames.pose, np.concatenate([poses for poses, _ in written.values()]).reshape(frames.pose.shape)
    )
    np.testing.assert_array_equal(frames.transl, np.concatenate([trans for _, trans in written.values()]))
    assert frames.betas.shape == (len(found), 16)
    assert set(frames.genders) == {"female"}
    np.testing.assert_array_equal(frames.ground.normal, [0, 0, 1])
    ending = {"smplh": "poses", "smplx": "stageii"}[kind]
    assert frames.names[0] == f"ACCAD/s1/walk0_{ending}/00000"
    assert frames.sequences[-1].startswith("Transitions")
    assert len(np.unique(frames.names)) == len(frames)
    assert found[:10].frame_rate == 60
    wrong = [each for each in amass.check(tmp_path) if each.level != "ok"]
    assert wrong == []


def test_splits(tmp_path):
    miniature.tree(tmp_path)
    found = {split: data.open("amass", tmp_path, split=split) for split in amass.SPLITS}
    first = {split: {name.split("/")[0] for name in each[:].names} for split, each in found.items()}
    assert first == {
        "train": {"ACCAD", "CMU"},
        "vald": {"HumanEva", "MPI_mosh"},
        "test": {"SSM_synced", "Transitions_mocap"},
    }
    with pytest.raises(ValueError, match="split: expected one of vald, test, train, got 'val'"):
        data.open("amass", tmp_path, split="val")
    with pytest.raises(ValueError, match="expected motions of CMU, .* found none"):
        data.open("amass", tmp_path / "HumanEva", split="train")


def test_fewer_frames_a_second(tmp_path):
    poses, _ = miniature.motion(tmp_path / "a.npz", frames=100, rate=120.0)
    for wanted, rows in (
        (30.0, np.arange(0, 100, 4)),
        (50.0, np.floor(np.arange(42) * 2.4).astype(int)),
        (240.0, np.arange(100)),
    ):
        frames = data.open("amass", tmp_path / "a.npz", frame_rate=wanted)[:]
        assert frames.frame_rate == wanted
        assert frames.names.tolist() == [f"a/{row:05d}" for row in rows]
        np.testing.assert_array_equal(frames.pose.reshape(len(rows), -1), poses[rows])
    with pytest.raises(ValueError, match="frame_rate: expected Hz above 0, got 0"):
        data.open("amass", tmp_path / "a.npz", frame_rate=0)


@pytest.mark.parametrize("rate", [None, 60.0])
def test_betas_of_each_frame(tmp_path, rate):
    betas = np.random.default_rng(1).normal(size=(20, 16))
    miniature.motion(tmp_path / "a.npz", betas=betas)
    frames = data.open("amass", tmp_path / "a.npz", frame_rate=rate)[:]
    np.testing.assert_array_equal(frames.betas, betas[:: 1 if rate is None else 2])
    miniature.motion(tmp_path / "b.npz", betas=betas[:1])
    np.testing.assert_array_equal(data.open("amass", tmp_path / "b.npz")[:].betas, np.repeat(betas[:1], 20, axis=0))


def test_only_headers_are_read_when_it_is_opened(tmp_path, monkeypatch):
    miniature.tree(tmp_path)
    for number in range(60):
        miniature.motion(tmp_path / "KIT" / f"{number}_poses.npz")
    read = []
    monkeypatch.setattr(amass, "_numbers", lambda file, name, own=amass._numbers: read.append(file) or own(file, name))
    found = data.open("amass", tmp_path)
    assert len(set(read)) == 16  # the sample that is judged, of 72
    read.clear()
    assert len(found[100:101]) == 1
    assert len(set(read)) <= 1


BAD = {
    "poses": [
        ({"poses": np.zeros((20, 100))}, r"poses: expected \(F, n\) with n of 72, 156, 165, got \(20, 100\)"),
        ({"poses": np.zeros((0, 156)), "trans": np.zeros((0, 3))}, "expected frames, the motion is empty"),
        ({"poses": np.full((20, 156), "a")}, "poses: expected numbers, got type <U1"),
    ],
    "rest": [
        ({"trans": np.zeros((19, 3))}, r"trans: expected \(20, 3\) as poses has 20 frames, got \(19, 3\)"),
        ({"betas": None}, "no betas among its arrays"),
        ({"betas": np.zeros((19, 16))}, r"betas: expected \(n,\) or \(20, n\), a row for each frame, got \(19, 16\)"),
        ({"betas": np.zeros((1, 20, 16))}, r"betas: expected \(n,\) or \(20, n\)"),
        ({"betas": np.float64(1.0)}, r"betas: expected \(n,\) or \(20, n\)"),
        ({"mocap_framerate": None}, "expected mocap_framerate or mocap_frame_rate, found neither"),
        ({"mocap_framerate": -1.0}, "mocap_framerate: expected Hz"),
        ({"gender": "woman"}, "gender: expected neutral, female or male, got 'woman'"),
        ({"gender": 3}, "gender: expected a word"),
        ({"scale": 1000.0}, "transl: looks like millimetres: 1[0-9]* from the origin"),
        ({"poses": np.full((20, 156), 90.0)}, "pose: looks like degrees"),
    ],
}


@pytest.mark.parametrize(("changes", "message"), [*BAD["poses"], *BAD["rest"]])
def test_motions_that_cannot_be(tmp_path, changes, message):
    miniature.motion(tmp_path / "a.npz", **changes)
    with pytest.raises(ValueError, match=f"a.npz: {message}"):
        data.open("amass", tmp_path / "a.npz")[:]
    assert any(each.level == "wrong" and "a.npz" in each.what for each in amass.check(tmp_path / "a.npz"))


def test_bytes_and_no_word_for_the_gender(tmp_path):
    miniature.motion(tmp_path / "a.npz", gender=np.bytes_(b"male"))
    assert set(data.open("amass", tmp_path / "a.npz")[:].genders) == {"male"}
    miniature.motion(tmp_path / "a.npz", gender=None)
    assert set(data.open("amass", tmp_path / "a.npz")[:].genders) == {"neutral"}


def test_y_up_instead_of_z_up(tmp_path):
    miniature.tree(tmp_path, up="y")
    with pytest.raises(ValueError, match=r"pose: looks like \+y up: .* up is said to be \(0, 0, 1\)"):
        data.open("amass", tmp_path)
    wrong = [each.what for each in amass.check(tmp_path) if each.level == "wrong"]
    assert any("pose: looks like +y up" in what for what in wrong)


def test_somebody_who_lies_is_right(tmp_path):
    miniature.motion(tmp_path / "a.npz", lies=True)
    assert len(data.open("amass", tmp_path / "a.npz")) == 20


def test_both_releases_at_once(tmp_path):
    miniature.motion(tmp_path / "CMU" / "a.npz")
    miniature.motion(tmp_path / "CMU" / "b.npz", kind="smplx")
    with pytest.raises(ValueError, match=r"b.npz: poses: expected 156 columns as in a.npz, got 165"):
        data.open("amass", tmp_path)


def test_damaged_hostile_and_missing_files(tmp_path):
    path = tmp_path / "CMU" / "a.npz"
    miniature.motion(path)
    whole = path.read_bytes()
    for size in (0, 10, len(whole) // 2):
        path.write_bytes(whole[:size])
        with pytest.raises(ValueError, match=r"a.npz: not a .npz file .* is the download complete"):
            data.open("amass", tmp_path)
    assert any(each.level == "wrong" and "a.npz" in each.what for each in amass.check(tmp_path))

    class Runs:
        def __reduce__(self):
            return open, (str(tmp_path / "victim"), "w")

    miniature.motion(path, gender=np.array([Runs()], dtype=object))
    with pytest.raises(ValueError, match="a.npz: array 'gender' cannot be read: holds Python objects"):
        data.open("amass", tmp_path)[:]
    path.write_bytes(pickle.dumps(Runs()))
    with pytest.raises(ValueError, match="a.npz: not a .npz file"):
        data.open("amass", tmp_path)
    assert not (tmp_path / "victim").exists()
    with pytest.raises(ValueError, match=r"expected a motion \(.npz\), no such file or folder"):
        data.open("amass", tmp_path / "nothing")
    assert amass.check(tmp_path / "nothing")[0].level == "missing"


def test_a_frame_of_nan(tmp_path):
    poses = np.zeros((20, 156))
    poses[:, :3] = miniature.STANDING
    poses[7] = np.nan
    miniature.motion(tmp_path / "a.npz", poses=poses)
    frames = data.open("amass", tmp_path / "a.npz")[:]
    assert np.isnan(frames.pose[7]).all()
    assert np.isfinite(np.delete(frames.pose, 7, axis=0)).all()


def test_shape_of_an_array_without_reading_it(tmp_path):
    np.savez_compressed(tmp_path / "a.npz", poses=np.zeros((7, 5, 3)))
    assert safe_npz.shape_of(tmp_path / "a.npz", "poses") == (7, 5, 3)
    with pytest.raises(ValueError, match="a.npz: array 'trans' cannot be read"):
        safe_npz.shape_of(tmp_path / "a.npz", "trans")
