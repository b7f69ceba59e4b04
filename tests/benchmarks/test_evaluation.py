"""benchmarks/evaluation.py: the made frames are what they say, and the command measures them. Nothing is timed here."""

from __future__ import annotations

import numpy as np
import pytest

pytest.importorskip("resource")

import ipman_rs as ip
from benchmarks import evaluation


def test_made_frames(tmp_path):
    evaluation.write_truth(tmp_path / "truth-60.npz", 60)
    evaluation.write_predictions(tmp_path / "noisy-60.npz", 60, nan=25)
    with np.load(tmp_path / "truth-60.npz") as truth, np.load(tmp_path / "noisy-60.npz") as noisy:
        assert (noisy["names"] == truth["names"]).all()
        assert len(set(truth["names"].tolist())) == 60
        assert np.flatnonzero(np.isnan(noisy["pose"]).any(axis=1)).tolist() == [0, 25, 50]
        vertices = ip.load_body(str(truth["body"]))(truth["pose"].reshape(60, 24, 3), truth["betas"], truth["transl"])
        assert np.abs(vertices.vertices[..., 1].min(axis=1)).max() < 0.2
        assert 0.08 < np.nanstd(noisy["pose"] - truth["pose"]) < 0.12


@pytest.mark.slow
def test_the_command_measures_them(tmp_path):
    evaluation.write_truth(tmp_path / "truth-40.npz", 40)
    evaluation.write_predictions(tmp_path / "noisy-40.npz", 40)
    found = evaluation.run(evaluation.command(tmp_path, tmp_path / "out", frames=40))
    assert found["said"].startswith("40 frames in ")
    assert found["peak_megabytes"] > 10
    names = set(evaluation.fingerprints(tmp_path / "out"))
    assert names == {*evaluation.REPORTS, "methods/noisy-40/000000.npz"}
