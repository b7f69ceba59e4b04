"""The distribution of L_stability: of known numbers, of one's own bodies, and of data sets."""

from __future__ import annotations

import numpy as np
import pytest

import ipman_rs as ip
from ipman_rs.paper_figures.stability_distribution import Losses, stability_distribution, summary

NAMES = ("standing", "tree", "lean_past_toes", "squat")


def losses(values):
    values = np.asarray(values, float)
    return Losses("some", values, np.arange(len(values)).astype(str), np.ones(len(values), bool), "paper-r")


def test_numbers_of_known_values():
    found = summary(losses([0.0, 0.012, 0.013, 0.049, 0.2]), 0.01)
    assert found["bodies"] == 5
    assert found["median_m"] == 0.013
    assert found["share_below_50_mm"] == 0.8
    assert found["peak_m"] == [0.01, 0.02]
    assert not found["peaks_at_0"]
    assert found["shares"].sum() == pytest.approx(1)
    assert summary(losses([0.0, 0.001, 0.1]), 0.01)["peaks_at_0"]
    assert summary(losses([0.0, 0.0]), 0.01)["shares"].tolist() == [1.0]


def test_a_distance_without_bias_peaks_at_its_spread():
    """The distance of normal coordinates has Rayleigh's distribution: its mode is σ, its median σ √(2 ln 2)."""
    apart = np.random.default_rng(0).normal(scale=0.1, size=(200_000, 2))
    found = summary(losses(np.linalg.norm(apart, axis=1)), 0.01)
    assert not found["peaks_at_0"]
    assert 0.08 <= found["peak_m"][0] <= 0.11  # the top is flat: within 2 % of the mode's density
    assert found["median_m"] == pytest.approx(0.1 * np.sqrt(2 * np.log(2)), rel=0.01)


@pytest.fixture
def own(tmp_path, lite):
    """Named poses as one's own data set, their vertices, and one frame without a body."""
    vertices = np.stack([ip.body.posed(lite, name) for name in NAMES])
    pose = np.stack([ip.body.poses.pose_of(lite, name) for name in NAMES])
    transl = vertices[:, 0] - np.asarray(lite(pose).vertices)[:, 0]
    pose, transl = np.concatenate([pose, pose[:1]]), np.concatenate([transl, np.full((1, 3), np.nan)])
    np.savez(
        tmp_path / "own.npz", names=[*NAMES, "lost"], pose=pose, transl=transl, body="anny-lite", ground=[0.0, 1, 0, 0]
    )
    return tmp_path / "own.npz", vertices


@pytest.mark.slow
def test_own_bodies(figure, own, lite, contents):
    path, vertices = own
    said = figure("stability", "--data", "own", "--path", path)
    assert said.code == 0, said.err
    apart = ip.center_of_mass(vertices, lite.template) - ip.center_of_pressure(
        vertices, lite.template, ip.Ground.y_up()
    )
    expected = np.linalg.norm(apart[:, [0, 2]], axis=1)
    with np.load(said.folder / "stability.npz") as stored:
        np.testing.assert_allclose(stored["values_0"], expected, atol=1e-6)  # float32 bodies
        assert stored["frames_0"].tolist() == list(NAMES)
    (about,) = said.numbers["data"]
    assert about["median_m"] == pytest.approx(np.median(expected), abs=1e-6)
    assert about["touching"] == 1
    assert f"median {1e3 * np.median(expected):.0f} mm" in said.out
    again = figure("stability", "--data", "own", "--path", path, out="again")
    assert contents(said.folder) == contents(again.folder)


def test_some_frames_of_several_data_sets(figure, own):
    path, _ = own
    said = figure("stability", "--data", "own", "--path", path, "--data", "own", "--path", path, "--every", 2)
    assert said.code == 0, said.err
    assert [(each["name"], each["bodies"]) for each in said.numbers["data"]] == [("own", 2), ("own-2", 2)]


@pytest.mark.slow
def test_built_people(figure):
    said = figure("stability", "--people", 7)
    assert said.code == 0, said.err
    (about,) = said.numbers["data"]
    assert about["bodies"] == 7
    assert about["median_m"] > 0.05  # they balance, but the paper's CoP is not under their CoM


def test_a_data_set_s_bodies_need_their_model(figure, tmp_path):
    from tests.helpers.miniatures import amass

    amass.tree(tmp_path / "amass")
    said = figure("stability", "--data", "amass", "--path", tmp_path / "amass")
    assert said.code == 1
    assert said.err.count("\n") == 1
    assert "--models" in said.err


def test_no_ground(figure, tmp_path, lite):
    np.savez(tmp_path / "own.npz", names=["a"], pose=np.zeros((1, 24, 3)), transl=np.zeros((1, 3)), body="anny-lite")
    said = figure("stability", "--data", "own", "--path", tmp_path / "own.npz")
    assert said.code == 1
    assert said.err.startswith("ipman: error: own: has no ground")


@pytest.mark.parametrize(
    ("arguments", "code", "words"),
    [
        (("--data", "amass"), 2, "--path"),
        (("--data", "amass", "--path", "/nowhere"), 1, "/nowhere"),
        (("--data", "nonsense", "--path", "/"), 1, "nonsense"),
        (("--every", 0), 2, "--every"),
        (("--data", "amass", "--path", "/", "--models", "/nowhere"), 1, "/"),
    ],
)
def test_wrong_usage(arguments, code, words, figure):
    said = figure("stability", *arguments)
    assert said.code == code
    assert words in said.err
    assert "Traceback" not in said.err


def test_nothing_to_draw():
    with pytest.raises(ValueError, match="at least one"):
        stability_distribution([])
