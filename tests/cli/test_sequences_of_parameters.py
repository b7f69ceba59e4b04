"""`ipman analyze` on parameter files: posed a piece at a time, with the figures of all frames at once."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import threading
import time

import numpy as np
import pytest

import ipman_rs as ip
from ipman_rs import view
from ipman_rs.io.parameters import read_npz
from ipman_rs.study import from_file
from tests.helpers.cli_files import report, strict, walk_parameters

FIELDS = ("status", "mass", "center_of_mass", "center_of_pressure", "inertia", "stability", "push", "balance", "lowest")


@pytest.fixture
def no_pictures(monkeypatch):
    for name in ("draw_picture", "draw_floor_view"):
        monkeypatch.setattr(f"ipman_rs.view.report.{name}", lambda study, frame, path: path.write_bytes(b"png"))


def thousand(folder):
    """1,000 frames near the floor y = 0, number 500 not a number."""
    rng = np.random.default_rng(1)
    pose = rng.normal(scale=0.1, size=(1000, 72)).astype(np.float32)
    pose[500, 9] = np.nan
    transl = np.tile(np.array([0.0, 0.9, 0.0], np.float32), (1000, 1))
    np.savez(folder / "many.npz", pose=pose, betas=np.full(10, 0.2, np.float32), transl=transl)
    return folder / "many.npz", pose.reshape(-1, 24, 3), np.full(10, 0.2, np.float32), transl


@pytest.mark.slow
def test_a_thousand_frames(run, tmp_path, lite_body, no_pictures):
    file, pose, betas, transl = thousand(tmp_path)
    assert not isinstance(read_npz(file, "anny-lite").vertices, np.ndarray)
    result = run("analyze", file, "--body", "anny-lite", "-o", tmp_path / "out")
    assert result.code == 0, result.err
    vertices = lite_body(pose, betas, transl).vertices
    height = float(np.nanmin(vertices[..., 1].astype(np.float64)))
    expected = ip.analyze(vertices, lite_body.template, ip.Ground(height=height), with_pressure=False)
    support = expected.base_of_support
    with np.load(tmp_path / "out" / "report.npz") as stored:
        assert stored["ground_height"] == height
        for name in FIELDS:
            np.testing.assert_array_equal(stored[name], getattr(expected, name), err_msg=name)
        np.testing.assert_array_equal(stored["margin"], support.margin)
        np.testing.assert_array_equal(stored["polygon"], np.concatenate(support.polygon))
        np.testing.assert_array_equal(np.diff(stored["polygon_start"]), [len(p) for p in support.polygon])
        np.testing.assert_array_equal(stored["vertices"], vertices[stored["key_frames"]])
    frames = report(tmp_path / "out")["bodies"][0]["frames"]
    assert [frame["frame"] for frame in frames] == list(range(1000))
    assert frames[500]["status"] == ["NON_FINITE"]
    assert frames[500]["mass"] is None
    assert frames[501]["mass"] == expected.mass[501]


@pytest.mark.parametrize("up", ["y", "-y", "0.1,1,0"])
def test_the_ground_is_found_for_any_piece(up, run, tmp_path, monkeypatch):
    np.savez(tmp_path / "walk.npz", **walk_parameters(30))
    heights = set()
    for piece in (1, 7, 64):
        monkeypatch.setattr(from_file, "PIECE", piece)
        result = run("analyze", tmp_path / "walk.npz", "--body", "anny-lite", f"--up={up}", "--json")
        assert result.code == 0, result.err
        heights.add(strict(result.out)["bodies"][0]["ground"]["height"])
    assert len(heights) == 1


@pytest.mark.slow
def test_a_long_recording_is_listed_in_part(run, tmp_path, monkeypatch, no_pictures):
    """The figures of all frames are in report.npz; 20 evenly spaced ones and the drawn ones in the page's lists."""
    np.savez(tmp_path / "walk.npz", **walk_parameters(70))
    arguments = ("analyze", tmp_path / "walk.npz", "--body", "anny-lite", "-o")
    assert run(*arguments, tmp_path / "all").code == 0
    for module in (view.study.__module__, "ipman_rs.view.report"):
        monkeypatch.setattr(sys.modules[module], "MAX_LISTED_FRAMES", 20)
    monkeypatch.setattr(sys.modules[view.study.__module__], "MAX_KEY_FRAMES", 5)
    assert run(*arguments, tmp_path / "some").code == 0
    everything, some = (report(tmp_path / name)["bodies"][0] for name in ("all", "some"))
    numbers = [frame["frame"] for frame in some["frames"]]
    assert numbers[0] == 0
    assert numbers[-1] == 69
    assert 20 <= len(numbers) <= 27
    for number, frame in zip(numbers, some["frames"], strict=True):
        assert frame == everything["frames"][number]
        assert frame["polygon"]
    assert some["notes"][-1] == f"frames: {len(numbers)} of 70 are listed here; report.npz has the figures of all"
    with np.load(tmp_path / "all" / "report.npz") as whole, np.load(tmp_path / "some" / "report.npz") as stored:
        for name in (*FIELDS, "margin", "area"):
            np.testing.assert_array_equal(stored[name], whole[name])
        kept = np.flatnonzero(np.diff(stored["polygon_start"]))
        assert kept.tolist() == numbers
        assert stored["key_frames"].tolist() == [0, 17, 34, 52, 69]
        assert stored["vertices"].shape[0] == 5


@pytest.mark.slow
@pytest.mark.skipif(sys.platform == "win32", reason="signals differ there")
def test_ctrl_c_ends_a_long_analysis(tmp_path):
    np.savez(tmp_path / "long.npz", pose=np.zeros((300_000, 72), np.float32))
    command = [
        sys.executable,
        "-c",
        "from ipman_rs.cli import main; main()",
        "analyze",
        tmp_path / "long.npz",
        "-o",
        tmp_path / "out",
    ]
    process = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, env=os.environ)
    watchdog = threading.Timer(60, process.kill)
    watchdog.start()
    try:
        time.sleep(4)  # it has started to look for the ground or to analyse
        assert process.poll() is None
        sent = time.monotonic()
        process.send_signal(signal.SIGINT)
        _, err = process.communicate()
        took = time.monotonic() - sent
    finally:
        watchdog.cancel()
        process.kill()
    assert process.returncode == 130
    assert "ipman: interrupted" in err
    assert "Traceback" not in err
    assert took < 2.0
    assert not (tmp_path / "out").exists()
