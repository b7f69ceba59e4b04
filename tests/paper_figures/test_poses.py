"""The map of poses: the same bytes each time, and poses of other kinds apart."""

from __future__ import annotations

import sys

import numpy as np
import pytest

from ipman_rs.paper_figures import poses as made

pytest.importorskip("sklearn", reason="scikit-learn is the extra figures")


def own(path, middle, count=40, seed=0, joints=24):
    """Poses around one, a bent knee."""
    pose = np.random.default_rng(seed).normal(scale=0.05, size=(count, joints, 3))
    pose[:, 4, 0] += middle
    np.savez(path, names=[f"{number:03d}" for number in range(count)], pose=pose, body="anny-lite")
    return pose


@pytest.mark.slow
def test_two_data_sets(figure, tmp_path, contents):
    own(tmp_path / "a.npz", 0.0)
    own(tmp_path / "b.npz", 2.0, seed=1)
    sets = [word for name in ("a", "b") for word in ("--data", "own", "--path", tmp_path / f"{name}.npz")]
    said = figure("poses", *sets, "--most", 30, "--perplexity", 10)
    assert said.code == 0, said.err
    assert said.numbers["groups"] == {"own": 30, "own-2": 30}
    assert said.numbers["nearest_neighbour_of_same_group"] == 1
    assert said.numbers["nearest_neighbour_of_same_group_by_chance"] == 0.5
    lines = (said.folder / "poses.csv").read_text().splitlines()
    assert len(lines) == 61
    assert lines[1].startswith("own,000,")
    assert lines[30].startswith("own,039,")  # evenly spaced, the last one included
    again = figure("poses", *sets, "--most", 30, "--perplexity", 10, out="again")
    assert contents(said.folder) == contents(again.folder)


@pytest.mark.slow
def test_mixed_data_sets_are_neighbours_by_chance(figure, tmp_path):
    own(tmp_path / "a.npz", 0.0, 60)
    own(tmp_path / "b.npz", 0.0, 60, seed=1)
    sets = [word for name in ("a", "b") for word in ("--data", "own", "--path", tmp_path / f"{name}.npz")]
    said = figure("poses", *sets)
    assert abs(said.numbers["nearest_neighbour_of_same_group"] - 0.5) < 0.15  # three standard errors of 120


def test_neither_root_nor_hands_count(tmp_path):
    pose = np.random.default_rng(2).normal(size=(3, 24, 3))
    other = pose.copy()
    other[:, [0, 22, 23]] += 1
    frames = [type("F", (), {"pose": each, "names": np.array(["a", "b", "c"])})() for each in (pose, other)]
    found = [made.of_data_set("d", _Rows(each)) for each in frames]  # type: ignore[arg-type]
    assert np.array_equal(found[0].values, found[1].values)
    assert found[0].values.shape == (3, 189)


class _Rows:
    def __init__(self, frames):
        self.frames = frames

    def __len__(self):
        return len(self.frames.pose)

    def __getitem__(self, rows):
        return self.frames


@pytest.mark.parametrize("perplexity", [0, 5, "nan"])
def test_too_few_poses(perplexity, figure, tmp_path):
    own(tmp_path / "a.npz", 0.0, 5)
    said = figure("poses", "--data", "own", "--path", tmp_path / "a.npz", "--perplexity", perplexity)
    assert said.code == 1
    assert "perplexity: expected" in said.err


def test_without_scikit_learn(figure, tmp_path, monkeypatch):
    own(tmp_path / "a.npz", 0.0)
    monkeypatch.setitem(sys.modules, "sklearn.manifold", None)
    said = figure("poses", "--data", "own", "--path", tmp_path / "a.npz")
    assert said.code == 1
    assert said.err == "ipman: error: t-SNE needs scikit-learn: pip install 'ipman_rs[figures]'\n"


@pytest.mark.slow
def test_built_people(figure):
    said = figure("poses", "--people", 14, "--perplexity", 3)
    assert said.code == 0, said.err
    assert len(said.numbers["groups"]) == 7
