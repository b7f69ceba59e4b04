"""`ipman simulate`: table, JSON, arrays, filmstrips, sequences, bad files."""

from __future__ import annotations

import numpy as np
import pytest
from cli_files import strict, walk_parameters

import ipman_rs as ip
from ipman_rs.simulation import simulate, tip_test
from ipman_rs.view import colors
from ipman_rs.view.filmstrip import HEIGHT, WIDTH, turn_across


@pytest.fixture(scope="module")
def poses(lite_body, tmp_path_factory):
    """A file with two bodies of the light twin: one stands, one falls; and a third that is not finite."""
    vertices = np.stack([ip.body.posed(lite_body, name) for name in ("squat", "lean_past_toes", "squat")])
    vertices[2] = np.nan
    path = tmp_path_factory.mktemp("poses") / "poses.npz"
    np.savez(path, vertices=vertices, faces=lite_body.faces)
    return path, vertices


def test_table_and_files(run, poses, lite_body, tmp_path):
    path, vertices = poses
    done = run("simulate", path, "-o", tmp_path / "out", "--times", "0.1,1.5")
    assert done.code == 0, done.err
    rows = [line for line in done.out.splitlines() if line.startswith("poses.npz")]
    assert [row.split()[-1] for row in rows] == ["yes", "no", "non_finite"]
    expected = simulate(vertices, lite_body.template, ip.Ground(height=np.nanmin(vertices[..., 1])), (0.1, 1.5))
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


def test_json_alone_and_the_tip_test_alone(run, poses):
    done = run("simulate", poses[0], "--tip-only", "--json")
    assert done.code == 0
    (body,) = strict(done.out)["bodies"]
    assert "engine" not in body
    assert [frame["stands"] for frame in body["frames"]] == [True, False, None]
    assert "displacement" not in body["frames"][0]


def test_a_sequence_of_parameters_is_summed_up(run, tmp_path):
    np.savez(tmp_path / "walk.npz", **walk_parameters(60))
    done = run("simulate", tmp_path / "walk.npz", "--body", "anny-lite", "--times", "0.05")
    assert done.code == 0, done.err
    (row,) = [line for line in done.out.splitlines() if line.startswith("walk.npz")]
    assert "(60 frames)" in row
    assert "%" in row


@pytest.mark.parametrize("engine", ["bullet", "mujoco"])
def test_other_engines(run, poses, engine):
    pytest.importorskip({"bullet": "pybullet"}.get(engine, engine))
    done = run("simulate", poses[0], "--engine", engine, "--json", "--times", "1.5")
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


def test_a_fall_runs_across_the_picture():
    up = np.array([0.0, 1.0, 0.0])
    for motion in ([0.3, -0.5, 0.1], [-0.2, 0.0, 0.0], [0.0, -1.0, 2.0]):
        turn = np.radians(turn_across(np.array(motion), up))
        back = np.cos(turn) * np.array([0.0, 0.0, 1.0]) + np.sin(turn) * np.array([1.0, 0.0, 0.0])
        assert abs(back @ motion) < 1e-12
    assert turn_across(np.array([0.01, -1.0, 0.0]), up) == 35.0
