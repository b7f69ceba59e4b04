"""benchmarks/million.py: `ipman analyze` reads its file, and its figures are there. Nothing is timed here."""

from __future__ import annotations

import json

import numpy as np
import pytest

pytest.importorskip("resource")

from click.testing import CliRunner

import ipman_rs as ip
from benchmarks import million


def test_the_bodies_stand_near_the_floor(tmp_path):
    million.write_parameters(tmp_path / "bodies.npz", 40)
    with np.load(tmp_path / "bodies.npz") as stored:
        assert {name: stored[name].dtype for name in stored} == dict.fromkeys(("pose", "betas", "transl"), np.float32)
        body = ip.load_body("anny")
        vertices = body(stored["pose"].reshape(40, 24, 3), stored["betas"], stored["transl"]).vertices
    lowest = vertices[..., 1].min(axis=-1)
    assert np.abs(lowest).max() < 0.2
    assert np.abs(lowest).mean() < 0.05


def test_the_run_tells_speed_and_memory(tmp_path, monkeypatch):
    million.write_parameters(tmp_path / "bodies.npz", 5)
    monkeypatch.setattr("ipman_rs.view.report.write_report", lambda studies, folder: folder)
    done = CliRunner().invoke(million.main, ["run", str(tmp_path / "bodies.npz"), str(tmp_path / "out")])
    assert done.exit_code == 0, done.output
    found = json.loads(done.output)
    assert found["bodies_a_second"] > 1
    assert found["peak_megabytes_with_report"] >= found["peak_megabytes"] > 10
