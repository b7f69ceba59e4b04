"""Photos with labels: what is read, what is met, and a run on one person."""

from __future__ import annotations

import json
import shutil
from importlib import resources

import numpy as np
import pytest
from click.testing import CliRunner

from ipman_rs.ablation.photos.labels import Label, read_labels
from ipman_rs.ablation.photos.verdict import Measures, judge, trunk_direction
from ipman_rs.cli import main

HEAD = "file,posture,trunk_lean_deg,lean_direction,feet_on_floor,camera_pitch_deg,balanced\n"
STANDING = Label("a.jpg", "stand", (0.0, 0.0, 1.0), (True, True), 10.0, True)
UPRIGHT = Measures(0.05, (0.001, -0.01), (0.0, 0.1, 0.995), 4.0, 0.7, "green", "feet", ())


def labels(folder, *lines: str):
    (folder / "labels.csv").write_text(HEAD + "\n".join(lines) + "\n")
    return read_labels(folder)


def test_labels(tmp_path):
    lunge, jump, odd = labels(
        tmp_path,
        "l.jpg,lunge,30,left,left (the right one on its toes),20,yes",
        "j.jpg,airborne,,,none,-10,no",
        "o.jpg,walk,0,none,one or both,unknown,unknown",
    )
    assert lunge.lean == pytest.approx((0, 0.5, np.sqrt(0.75)))
    assert (lunge.feet, lunge.pitch, lunge.balanced) == ((True, False), 20, True)
    assert jump == Label("j.jpg", "airborne", None, (False, False), -10, False)
    assert (odd.lean, odd.feet, odd.pitch, odd.balanced) == ((0, 0, 1), None, None, None)


@pytest.mark.parametrize(
    ("content", "message"),
    [
        (HEAD + "a.jpg,stand,x,none,both,0,yes\n", "line 2: trunk_lean_deg: expected degrees, got 'x'"),
        (HEAD + "a.jpg,stand,0,none,both,999,yes\n", "line 2: camera_pitch_deg: expected degrees from -180 to 180"),
        (HEAD, "expected a line for each photo, got none"),
        ("name\na\n", "expected the columns file, posture, got name"),
    ],
)
def test_labels_that_are_wrong(tmp_path, content, message):
    (tmp_path / "labels.csv").write_text(content)
    with pytest.raises(ValueError, match=message):
        read_labels(tmp_path)


def test_a_body_that_meets_all():
    assert judge(STANDING, UPRIGHT) == {
        "CoM over support": True, "soles": True, "lean": True, "pitch": True, "not pulled down": None,
    }  # fmt: skip


@pytest.mark.parametrize(
    ("change", "missed"),
    [
        ({"margin": -0.01}, "CoM over support"),
        ({"soles": (0.0, 0.021)}, "soles"),
        ({"trunk": (np.sin(0.3), 0.0, np.cos(0.3))}, "lean"),  # 17 degrees
        ({"pitch": -0.5}, "pitch"),
    ],
)
def test_what_is_missed(change, missed):
    verdict = judge(STANDING, Measures(**{**vars(UPRIGHT), **change}))
    assert [name for name, met in verdict.items() if met is False] == [missed]


def test_who_is_in_the_air_is_not_judged_as_standing():
    jump = Label("j.jpg", "airborne", (0.0, 0.0, 1.0), (False, False), None, False)
    moving = Measures(**{**vars(UPRIGHT), "support": "nothing", "margin": -1.0})
    assert judge(jump, moving) == {
        "CoM over support": None, "soles": None, "lean": None, "pitch": None, "not pulled down": True,
    }  # fmt: skip
    assert judge(jump, UPRIGHT)["not pulled down"] is False
    assert set(judge(STANDING, None).values()) == {False, None}


def test_the_trunk_of_a_person_who_faces_x():
    joints = {
        "left_hip": np.array([0, 1, -0.1]), "right_hip": np.array([0, 1, 0.1]), "neck": np.array([0.3, 1.5, -0.1]),
        "left_shoulder": np.array([0.3, 1.4, -0.2]), "right_shoulder": np.array([0.3, 1.4, 0.2]),
    }  # fmt: skip
    forward, left, up = np.array(trunk_direction(joints, np.array([0.0, 1.0, 0.0]))) * np.sqrt(0.09 + 0.25 + 0.01)
    assert (forward, left, up) == pytest.approx((0.3, 0.1, 0.5))


@pytest.mark.slow
def test_the_command(tmp_path):
    folder, output = tmp_path / "photos", tmp_path / "out"
    folder.mkdir()
    with resources.as_file(resources.files("ipman_rs.fitting") / "examples" / "basketball.json") as example:
        shutil.copy(example, folder / "ball.json")  # keypoints stand for the photo, which is not here
    labels(folder, "ball.jpg,stand,0,none,both,10,yes", "lost.jpg,stand,0,none,both,0,yes")
    run = CliRunner().invoke(main, ["benchmark", "photos", str(folder), "-o", str(output)])
    assert run.exit_code == 0, run.output
    record = json.loads((output / "photos_benchmark.json").read_text())
    ball, lost = record["photos"]
    met = dict.fromkeys(("CoM over support", "soles", "lean", "pitch"), True)
    assert ball["met"] == {**met, "not pulled down": None}
    assert lost["measures"] == {}
    assert "lost.jpg" in lost["failure"] or "no such file" in lost["failure"].lower()
    assert record["summaries"]["fast"]["soles"] == {"met": 1, "of": 2}
    assert (output / "photos_fast.png").stat().st_size > 10_000
    assert "| `fast` | 1 of 2 |" in (output / "photos_benchmark.md").read_text()
    assert len((output / "photos_benchmark.csv").read_text().splitlines()) == 3
