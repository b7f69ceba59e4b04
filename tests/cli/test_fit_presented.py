"""Every preset that imitates a pose, through the command line, on every named pose and on files of poses."""

from __future__ import annotations

import json

import numpy as np
import pytest
from click.testing import CliRunner

import ipman_rs as ip
from ipman_rs.body import poses
from ipman_rs.cli import main
from tests.helpers import keypoint_files as files


def fit(tmp_path, *arguments, code=0, pose="standing"):
    """A quick fit of a person in a pose, on whom the preset is tried; its record and what was said."""
    path = files.write(tmp_path / "anna.json", files.seen(pose))
    words = ["fit", path, "-o", tmp_path / "out", "--pictures", 0, "--iterations", 2, "--height", 1.7, *arguments]
    done = CliRunner().invoke(main, [str(word) for word in words])
    assert done.exit_code == code, done.output
    record = tmp_path / "out" / "anna" / "fit.json"
    return (json.loads(record.read_text()) if record.is_file() else None), done


@pytest.mark.slow
@pytest.mark.parametrize("name", poses.NAMES)
@pytest.mark.parametrize("preset", ["ipman-o", "smplify-xmc", "balanced"])
def test_each_preset_on_each_named_pose(preset, name, tmp_path, lite):
    """The presented body is as tall, and stands on its floor, as `ipman demo` draws it, to 1 mm."""
    record, _ = fit(tmp_path, "--preset", preset, "--pose", name, pose=name)
    drawn = ip.body.posed(lite, name)
    shown = record["presented"]
    assert shown["body_height_m"] == pytest.approx(np.ptp(drawn[:, 1]), abs=1e-3)
    assert shown["lowest_above_floor_m"] == pytest.approx(drawn[:, 1].min(), abs=1e-3)
    touching = {"tree": 24, "squat": 66}  # by the self-contact engine, of anny-lite
    assert shown["contact_vertices"] == touching.get(name, 0)
    left_out = any("nothing touches in it" in note for note in record["notes"])
    assert left_out == (name not in touching)
    # The floor of the fit is the presented one where the body stays in its frame.
    stored = dict(np.load(tmp_path / "out" / "anna" / "anna.npz"))
    assert stored["ground_height"][0] == pytest.approx(float(lite(poses.pose_of(lite, name)).vertices[:, 1].min()))
    if preset == "ipman-o":
        np.testing.assert_allclose(stored["global_orient"][0], poses.pose_of(lite, name)[0], atol=1e-12)
        np.testing.assert_allclose(stored["transl"][0], 0.0, atol=0)


@pytest.mark.slow
@pytest.mark.parametrize("preset", ["ipman-o", "smplify-xmc", "balanced"])
def test_a_pose_from_a_file(preset, tmp_path, lite):
    """The file of a body in a pose: the same fit as by the pose's name."""
    pose = poses.pose_of(lite, "squat")
    np.savez(
        tmp_path / "shown.npz", global_orient=pose[:1], body_pose=pose[1:].reshape(1, -1), model=np.array(lite.name)
    )
    fit(tmp_path, "--preset", preset, "--pose", tmp_path / "shown.npz", pose="squat")
    by_file = (tmp_path / "out" / "anna" / "anna.npz").read_bytes()
    fit(tmp_path, "--preset", preset, "--pose", "squat", pose="squat")
    assert (tmp_path / "out" / "anna" / "anna.npz").read_bytes() == by_file


@pytest.mark.slow
def test_contact_of_a_file(tmp_path):
    (tmp_path / "touch.json").write_text("[3, 900]")
    record, _ = fit(tmp_path, "--preset", "ipman-o", "--pose", "t_pose", "--contact", tmp_path / "touch.json")
    assert record["presented"]["contact_vertices"] == 2
    assert record["presented"]["contact_from"] == "given"


@pytest.mark.slow
def test_another_pose_file_is_fitted_anew(tmp_path, lite):
    """--resume looks at the content of the pose file, not at its name."""
    for name in ("squat", "chair"):
        pose = poses.pose_of(lite, name)
        np.savez(tmp_path / "shown.npz", pose=pose.reshape(1, -1), model=np.array(lite.name))
        record, _ = fit(tmp_path, "--preset", "balanced", "--pose", tmp_path / "shown.npz", "--resume")
        assert record["presented"]["body_height_m"] == pytest.approx(np.ptp(ip.body.posed(lite, name)[:, 1]))


@pytest.mark.parametrize(
    ("arguments", "says"),
    [
        (("--preset", "ipman-o"), "give its name or file with --pose"),
        (("--preset", "ipman-o", "--pose", "nonsense"), "no pose 'nonsense'"),
        (("--preset", "ipman-o", "--pose", "absent.npz"), "no such file"),
        (("--preset", "ipman-o", "--pose", "tree", "--contact", "absent.json"), "absent.json"),
        (("--preset", "fast", "--contact", "touch.json"), "say more of a --pose"),
    ],
)
def test_wrong_usage(arguments, says, tmp_path):
    _, done = fit(tmp_path, *arguments, code=2)
    assert says in done.stderr
