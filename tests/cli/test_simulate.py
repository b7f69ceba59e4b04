"""`ipman simulate`: table, JSON, arrays, filmstrips, sequences, bad files."""

from __future__ import annotations

import numpy as np
import pytest

import ipman_rs as ip
from ipman_rs.simulation import report, simulate, tip_test
from ipman_rs.simulation.comparison_report import _told_apart
from ipman_rs.view import colors
from ipman_rs.view.filmstrip import HEIGHT, WIDTH, turn_across
from tests.helpers.cli_files import strict, walk_parameters


@pytest.fixture(scope="module")
def poses(lite_body, tmp_path_factory):
    """A file with two bodies of the light twin: one stands, one falls; and a third that is not finite."""
    vertices = np.stack([ip.body.posed(lite_body, name) for name in ("squat", "lean_past_toes", "squat")])
    vertices[2] = np.nan
    path = tmp_path_factory.mktemp("poses") / "poses.npz"
    np.savez(path, vertices=vertices, faces=lite_body.faces)
    return path, vertices


@pytest.mark.slow
def test_table_and_files(run, poses, lite_body, tmp_path):
    path, vertices = poses
    done = run("simulate", path, "-o", tmp_path / "out", "--times", "0.1,2")
    assert done.code == 0, done.err
    rows = [line for line in done.out.splitlines() if line.startswith("poses.npz")]
    assert [row.split()[-1] for row in rows] == ["yes", "no", "non_finite"]
    expected = simulate(vertices, lite_body.template, ip.Ground(height=np.nanmin(vertices[..., 1])), (0.1, 2.0))
    tips = tip_test(vertices, lite_body.template, ip.Ground(height=np.nanmin(vertices[..., 1])))
    assert f"{1e3 * expected.displacement[1, 1]:.0f}" in rows[1]

    record = strict((tmp_path / "out" / "simulation.json").read_text(encoding="utf-8"))
    (body,) = record["bodies"]
    assert body["engine"] == "rapier"
    assert [frame["stands"] for frame in body["frames"]] == [True, False, None]
    assert body["frames"][1]["displacement"] == pytest.approx(expected.displacement[1].tolist())
    assert body["frames"][0]["margin"] == pytest.approx(float(tips.margin[0]))
    assert body["frames"][2]["margin"] is None
    assert body["frames"][2]["status"] == ["NON_FINITE"]

    arrays = np.load(tmp_path / "out" / "simulation.npz")
    np.testing.assert_array_equal(arrays["center"], expected.center)
    np.testing.assert_array_equal(arrays["tip_push"], tips.push)

    from PIL import Image

    assert {file.name for file in (tmp_path / "out").glob("*.png")} == {"fall_0.png", "fall_1.png"}
    picture = np.asarray(Image.open(tmp_path / "out" / "fall_1.png").convert("RGB")).astype(int)
    assert picture.shape == (HEIGHT, 6 * WIDTH, 3)
    pink = np.abs(picture - np.round(colors.rgb(colors.COM) * 255)).max(axis=-1) <= 10
    for column in range(6):
        found = pink[:, column * WIDTH : (column + 1) * WIDTH]
        assert found.sum() > 60, "each picture has its centre of mass"
        heights = np.flatnonzero(found.any(axis=1))
        if column in (0, 5):
            assert (heights.min() < 450) == (column == 0), "the centre of mass came down"


def test_no_verdict_before_two_seconds(run, poses):
    """The paper's 100 steps alone say how far a body has moved, not whether it stands."""
    done = run("simulate", poses[0], "--times", "0.41667")
    assert done.code == 0, done.err
    rows = [line for line in done.out.splitlines() if line.startswith("poses.npz")]
    assert [row.split()[-1] for row in rows] == ["–", "–", "non_finite"]
    assert "no verdict at 0.417 s" in done.out
    (body,) = strict(run("simulate", poses[0], "--times", "0.41667", "--json").out)["bodies"]
    assert [frame["stands"] for frame in body["frames"]] == [None, None, None]
    assert body["frames"][1]["displacement"][0] > 0.02
    assert any(note.startswith("no verdict at 0.417 s") for note in body["notes"])


def test_json_alone_and_the_tip_test_alone(run, poses):
    done = run("simulate", poses[0], "--tip-only", "--json")
    assert done.code == 0
    (body,) = strict(done.out)["bodies"]
    assert "engine" not in body
    assert [frame["stands"] for frame in body["frames"]] == [True, False, None]
    assert "displacement" not in body["frames"][0]


def test_a_sequence_of_parameters_is_summed_up(run, tmp_path):
    np.savez(tmp_path / "walk.npz", **walk_parameters(60))
    for option, last in ((("--times", "0.05"), "–"), (("--tip-only",), "%")):
        done = run("simulate", tmp_path / "walk.npz", "--body", "anny-lite", *option)
        assert done.code == 0, done.err
        (row,) = [line for line in done.out.splitlines() if line.startswith("walk.npz")]
        assert "(60 frames)" in row
        assert row.split()[-1] == last


@pytest.mark.parametrize("engine", ["bullet", "mujoco"])
def test_other_engines(run, poses, engine):
    pytest.importorskip({"bullet": "pybullet"}.get(engine, engine))
    done = run("simulate", poses[0], "--engine", engine, "--json", "--times", "2")
    assert done.code == 0, done.err
    (body,) = strict(done.out)["bodies"]
    assert body["engine"] == engine
    assert [frame["stands"] for frame in body["frames"]] == [True, False, None]


def test_bad_files_and_options(run, poses, tmp_path):
    (tmp_path / "broken.npz").write_bytes(b"no zip")
    done = run("simulate", tmp_path / "broken.npz", poses[0], "--tip-only", "--json")
    assert done.code == 1
    record = strict(done.out)
    assert len(record["bodies"]) == 1
    assert record["failures"][0]["file"].endswith("broken.npz")
    assert "broken.npz" in done.err
    for option in (("--times", "2,1"), ("--times", "x"), ("--step", "0"), ("--engine", "havok"), ("--friction", "-1")):
        assert run("simulate", poses[0], *option).code == 2


@pytest.mark.slow
def test_two_methods(run, poses, lite_body, tmp_path):
    """One method leans past its toes where the other squats; both have the body that is not finite."""
    path, vertices = poses
    steady = vertices.copy()
    steady[1] = vertices[0]
    np.savez(tmp_path / "steady.npz", vertices=steady, faces=lite_body.faces)
    output = tmp_path / "out"
    done = run("simulate", tmp_path / "steady.npz", "--against", path, "-o", output, "--filmstrips", "0")
    assert done.code == 0, done.err
    assert "stable after 2 s, %" in done.out
    assert "printed in the paper: +14.8 %" in done.out
    record = strict((output / "simulation.json").read_text(encoding="utf-8"))
    found = record["comparison"]
    assert (found["bodies"], found["left_out"]) == (2, 1)
    assert (found["stable"]["first"], found["stable"]["second"]) == (1.0, 0.5)
    assert found["more_stable_percent"][0] == pytest.approx(100.0)
    assert found["more_stable_percent_in_the_paper"] == 14.8
    moved = [[frame["displacement"][1] for frame in body["frames"][:2]] for body in record["bodies"]]
    assert found["displacement"][1]["ratio"]["mean"] == pytest.approx(np.mean(moved[0]) / np.mean(moved[1]))

    from PIL import Image

    picture = np.asarray(Image.open(output / "comparison.png").convert("RGB")).astype(int)
    for color in ((0x1F, 0x4E, 0x79), (0xC0, 0x50, 0x4D)):
        assert (np.abs(picture - color).max(axis=-1) < 10).sum() > 300, "a line for either method"
    words = (output / "comparison.svg").read_text(encoding="utf-8")
    assert "moved in 2 s, mm" in words
    assert "A: steady.npz" in words
    assert "B: poses.npz" in words

    early = run("simulate", tmp_path / "steady.npz", "--against", path, "--times", "0.41667")
    assert "stable, %: no verdict before 2 s" in early.out
    early = run("simulate", tmp_path / "steady.npz", "--against", path, "--times", "0.41667", "--json")
    found = strict(early.out)["comparison"]
    assert found["stable"] is None
    assert found["more_stable_percent"] is None
    assert found["displacement"][0]["ratio"]["mean"] < 1


def predictions(path, poses, names, **more):
    """Bodies as `ipman predict --data` and `ipman fit --data` write them."""
    values = {"pose": np.stack(poses), "betas": np.zeros((len(poses), 10)), "body": np.array("anny-lite"), **more}
    np.savez(path, names=np.array(names), **values)


@pytest.mark.slow
def test_predictions_are_paired_by_name_on_their_own_ground(run, tmp_path):
    """The floor of the first is y = 0.2, of the second z = −1; the second's rows stand in another order."""
    squat, leaning = ip.body.poses.pose("squat"), ip.body.poses.pose("lean_past_toes")
    lite = ip.load_body("anny-lite")
    lowest = [float(np.asarray(lite(pose).vertices)[:, 1].min()) for pose in (squat, leaning)]
    up = np.array([[0, 0.2 - lowest[0], 0], [0, 0.2 - lowest[1], 0]])
    predictions(tmp_path / "a.npz", [squat, leaning], ["x", "y"], transl=up, ground=np.array([0, 1, 0, 0.2]))
    predictions(
        tmp_path / "b.npz", [leaning, squat, squat], ["y", "z", "x"], transl=np.zeros((3, 3)),
        ground=np.array([[0, 1, 0, lowest[1]], [0, 1, 0, lowest[0]], [0, 1, 0, lowest[0]]]),
    )  # fmt: skip
    (tmp_path / "fit").mkdir()
    (tmp_path / "b.npz").rename(tmp_path / "fit" / "predictions.npz")  # a folder stands for the predictions in it
    done = run("simulate", tmp_path / "a.npz", "--against", tmp_path / "fit", "--json")
    assert done.code == 0, done.err
    record = strict(done.out)
    assert [[frame["name"] for frame in body["frames"]] for body in record["bodies"]] == [["x", "y"], ["y", "z", "x"]]
    assert [frame["status"] for body in record["bodies"] for frame in body["frames"]] == [[]] * 5
    found = record["comparison"]
    assert (found["bodies"], found["left_out"]) == (2, 1)
    # The same two bodies, somewhere else: nothing differs but the last digits.
    assert found["displacement"][1]["difference"]["mean"] == pytest.approx(0.0, abs=1e-3)
    assert found["stable"]["difference"]["mean"] == 0.0
    assert any("the file's own" in note for note in record["bodies"][0]["notes"])


def test_a_folder_of_fits(run, tmp_path):
    """As `ipman fit` leaves it: a folder an item, on a floor of its own, `fit.json` last."""
    for method, poses in (("ours", ("squat", "standing")), ("theirs", ("lean_past_toes", "standing"))):
        for k, name in enumerate(poses):
            folder = tmp_path / method / f"p{k}"
            folder.mkdir(parents=True)
            pose = ip.body.poses.pose(name)
            low = float(np.asarray(ip.load_body("anny-lite")(pose).vertices)[:, 1].min())
            np.savez(
                folder / f"p{k}.npz", global_orient=pose[:1], body_pose=pose[1:].reshape(1, -1),
                betas=np.zeros((1, 10)), transl=np.array([[0.0, k, 0.0]]), model=np.array("anny-lite"),
                ground_normal=np.array([[0.0, 1.0, 0.0]]), ground_height=np.array([low + k]),
            )  # fmt: skip
            (folder / "fit.json").write_text("{}")
    (tmp_path / "ours" / "p2").mkdir()  # not finished
    done = run("simulate", tmp_path / "ours", "--against", tmp_path / "theirs", "--json")
    assert done.code == 0, done.err
    record = strict(done.out)
    frames = [{frame["name"]: frame for frame in body["frames"]} for body in record["bodies"]]
    assert frames[0].keys() == frames[1].keys() == {"p0", "p1"}
    assert (frames[0]["p0"]["stands"], frames[1]["p0"]["stands"]) == (True, False)
    assert record["comparison"]["bodies"] == 2
    assert frames[0]["p1"]["status"] == []  # a metre above p0's floor, on its own


def test_files_of_the_same_name_are_told_apart_in_the_picture(tmp_path):
    a, b = tmp_path / "ours" / "out" / "predictions.npz", tmp_path / "theirs" / "out" / "predictions.npz"
    assert _told_apart(a, b) == ("ours/out/predictions.npz", "theirs/out/predictions.npz")
    assert _told_apart(a, a.parent) == ("predictions.npz", "out")
    assert _told_apart(a, a)[0].endswith("ours/out/predictions.npz")
    long = _told_apart(tmp_path / f"{'x' * 90}.npz", a)[0]
    assert (len(long), long[0], long[-5:]) == (48, "…", "x.npz")


@pytest.mark.parametrize("other", ["missing", "broken", "one", "twice", "others"])
def test_nothing_is_simulated_that_cannot_be_compared(run, other, tmp_path, lite_body, monkeypatch):
    squat = ip.body.poses.pose("squat")
    predictions(tmp_path / "a.npz", [squat, squat], ["x", "y"])
    predictions(tmp_path / "twice.npz", [squat, squat], ["x", "x"])
    predictions(tmp_path / "others.npz", [squat, squat], ["v", "w"])
    np.savez(tmp_path / "one.npz", vertices=ip.body.posed(lite_body, "squat")[None], faces=lite_body.faces)
    (tmp_path / "broken.npz").write_bytes(b"no zip")

    def simulated(*arguments, **options):
        raise AssertionError("simulated")

    monkeypatch.setattr(report, "simulate", simulated)
    done = run("simulate", tmp_path / "a.npz", "--against", tmp_path / f"{other}.npz", "--json")
    assert done.code == 1
    record = strict(done.out)
    assert record["bodies"] == []
    (failure,) = record["failures"]
    assert failure["file"].endswith(f"{other}.npz")
    assert done.err.count("\n") == 1


def test_what_was_assumed_is_printed(run, poses, tmp_path):
    """Once for each file, under the table; a ground that was given is none."""
    squat = ip.body.poses.pose("squat")
    predictions(tmp_path / "own.npz", [squat], ["x"], ground=np.array([0.0, 1.0, 0.0, -0.9]))
    done = run("simulate", poses[0], tmp_path / "own.npz", "--tip-only")
    assert done.code == 0, done.err
    first, second = (line for line in done.out.splitlines() if "; --ground" in line or "the file's own" in line)
    assert "poses.npz: up: y (assumed; --up says otherwise); ground: through the lowest vertex of all frames" in first
    assert second.endswith("own.npz: ground: the file's own (--up and --ground say otherwise)")
    given = run("simulate", poses[0], "--tip-only", "--up", "y", "--ground", "-1")
    assert "assumed" not in given.out
    assert "lowest vertex" not in given.out


def test_what_cannot_be_compared(run, poses, lite_body, tmp_path):
    np.savez(tmp_path / "one.npz", vertices=poses[1][:1], faces=lite_body.faces)
    done = run("simulate", tmp_path / "one.npz", "--against", poses[0], "--times", "0.1", "--json")
    assert done.code == 1
    assert "has 3 bodies" in done.err
    assert strict(done.out)["failures"][0]["file"].endswith("poses.npz")
    assert run("simulate", poses[0], poses[0], "--against", poses[0]).code == 2
    assert run("simulate", poses[0], "--against", poses[0], "--tip-only").code == 2
    (tmp_path / "empty").mkdir()
    done = run("simulate", tmp_path / "empty", "--times", "0.1")
    assert done.code == 1
    assert "neither predictions.npz nor finished fits" in done.err
    squat = ip.body.poses.pose("squat")
    predictions(tmp_path / "twice.npz", [squat, squat], ["x", "x"])
    predictions(tmp_path / "others.npz", [squat, squat], ["v", "w"])
    predictions(tmp_path / "once.npz", [squat], ["x"])
    predictions(tmp_path / "smpl.npz", [squat], ["w"], body=np.array("smpl"))
    predictions(tmp_path / "grounds.npz", [squat], ["w"], ground=np.zeros((3, 4)) + [0, 1, 0, 0])
    for name, said in (("twice", "names 1 bodies more than once"), ("others", "has no body of")):
        done = run("simulate", tmp_path / "once.npz", "--against", tmp_path / f"{name}.npz", "--times", "0.1")
        assert done.code == 1
        assert said in done.err
    done = run("simulate", tmp_path / "smpl.npz", "--times", "0.1")
    assert done.code == 1
    assert "'smpl', which is not included" in done.err
    done = run("simulate", tmp_path / "grounds.npz", "--times", "0.1")
    assert done.code == 1
    assert "has 3 grounds for 1 bodies" in done.err


def test_a_fall_runs_across_the_picture():
    up = np.array([0.0, 1.0, 0.0])
    for motion in ([0.3, -0.5, 0.1], [-0.2, 0.0, 0.0], [0.0, -1.0, 2.0]):
        turn = np.radians(turn_across(np.array(motion), up))
        back = np.cos(turn) * np.array([0.0, 0.0, 1.0]) + np.sin(turn) * np.array([1.0, 0.0, 0.0])
        assert abs(back @ motion) < 1e-12
    assert turn_across(np.array([0.01, -1.0, 0.0]), up) == 35.0
