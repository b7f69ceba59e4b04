"""`ipman evaluate` from the command line: what it writes, prints and refuses."""

from __future__ import annotations

import json
import re

import numpy as np
import pytest

import ipman_rs as ip
from ipman_rs.body import poses
from ipman_rs.cli import evaluate as command
from ipman_rs.evaluation.tables import TABLES, job
from ipman_rs.evaluation.tables.metrics import METRICS

FRAMES = 30


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """truth.npz, near.npz and far.npz: named poses, and two methods, of which one errs four times as much."""
    place = tmp_path_factory.mktemp("evaluate")
    draw = np.random.default_rng(0)
    pose = np.stack([poses.pose(name) for name in poses.NAMES])[np.arange(FRAMES) // 5 % len(poses.NAMES)]
    transl = np.zeros((FRAMES, 3))
    transl[:, 1] = -ip.load_body("anny-lite")(pose).vertices[..., 1].min(axis=1)
    names = np.array([f"seq{k // 5}/{k % 5}" for k in range(FRAMES)])
    center = ip.center_of_mass(
        ip.load_body("anny-lite")(pose, None, transl).vertices, ip.load_body("anny-lite").template
    )
    truth = {"names": names, "sequences": np.array([f"seq{k // 5}" for k in range(FRAMES)]), "body": "anny-lite"}
    ground = np.array([0.0, 1.0, 0.0, 0.0])
    np.savez(place / "truth.npz", **truth, pose=pose, transl=transl, ground=ground, center_of_mass=center)
    for name, noise in (("near", 0.05), ("far", 0.2)):
        noisy = pose + noise * draw.standard_normal(pose.shape)
        np.savez(place / f"{name}.npz", names=names, body="anny-lite", pose=noisy, transl=transl)
    return place


@pytest.fixture(scope="module")
def own(folder):
    return "--data", "own", "--path", folder / "truth.npz"


@pytest.mark.slow
def test_two_methods_of_a_data_set(run, folder, own, tmp_path):
    done = run("evaluate", folder / "far.npz", folder / "near.npz", *own, "-o", tmp_path / "out")
    assert done.code == 0, done.err
    assert re.search(r"60 frames in [\d.]+ s: [\d,]+ a second", done.out)
    written = {path.name for path in (tmp_path / "out").iterdir()}
    expected = {
        "evaluation.md",
        "evaluation.json",
        "evaluation.csv",
        "evaluation.svg",
        "evaluation.png",
        "sequences.csv",
    }
    assert expected <= written
    record = json.loads((tmp_path / "out" / "evaluation.json").read_text())
    mean = {name: each["figures"]["pve"]["mean"] for name, each in record["methods"].items()}
    assert 2 < mean["far"] / mean["near"] < 8
    lines = (tmp_path / "out" / "evaluation.csv").read_text().splitlines()
    shown = float(next(line for line in lines if line.startswith("near,PVE,mm")).split(",")[3])
    assert shown == pytest.approx(1000 * mean["near"], rel=1e-12)
    assert f"{shown:.1f} [" in done.out
    page = (tmp_path / "out" / "evaluation.md").read_text()
    assert "## near − far" in page
    assert re.search(r"\| PVE, mm \| −\d+\.\d \[−\d+\.\d, −\d+\.\d\] \| 0\.\d{4} \| 30 \| better \|", page)


@pytest.mark.slow
def test_frames_are_in_parquet(run, folder, own, tmp_path):
    parquet = pytest.importorskip("pyarrow.parquet")
    assert run("evaluate", folder / "near.npz", *own, "-o", tmp_path / "out").code == 0
    table = parquet.read_table(tmp_path / "out" / "frames.parquet").to_pydict()
    assert table["method"] == ["near"] * FRAMES
    assert table["name"][7] == "seq1/2"
    assert table["skating"][5] is None  # the first of a sequence: null, so that queries leave it out
    assert all(value > 0 for value in table["pve"])


@pytest.mark.slow
@pytest.mark.parametrize("table", TABLES)
def test_every_table_is_printed(table, run, folder, own, tmp_path):
    done = run("evaluate", folder / "near.npz", "--table", table, *own, "-o", tmp_path / "out")
    assert done.code == 0, done.err
    page = (tmp_path / "out" / "evaluation.md").read_text()
    assert page.startswith(f"# {TABLES[table].title}\n")
    for name in TABLES[table].metrics:
        assert METRICS[name].title in page
    for method, printed in TABLES[table].published.items():
        assert f"{method} (printed)" in page
        for name, value in printed.items():
            assert f" {value:.{METRICS[name].digits}f} |" in page


@pytest.mark.slow
def test_the_table_of_the_centre_of_mass(run, folder, own, tmp_path):
    """The paper's figures beside ours, one row a formulation."""
    run("evaluate", folder / "near.npz", "--table", "com", *own, "-o", tmp_path / "out")
    page = (tmp_path / "out" / "evaluation.md").read_text()
    assert re.search(r"\| CoM error, mm \| 53\.3 \| \d+\.\d \[", page)
    assert re.search(r"\| CoM vertices, mm \| 264\.1 \| \d+\.\d \[", page)
    assert re.search(r"\| CoM exact, mm \| – \| \d+\.\d \[", page)


@pytest.mark.slow
def test_the_bodies_of_the_data_set_itself(run, folder, own, tmp_path):
    """Their centre of mass is the one that was said to be measured; float32 figures, so 1e-6."""
    done = run("evaluate", "truth", "--table", "com", *own, "-o", tmp_path / "out")
    assert done.code == 0, done.err
    figures = json.loads((tmp_path / "out" / "evaluation.json").read_text())["methods"]["truth"]["figures"]
    assert figures["com_error"]["largest"] < 1e-6
    assert 0.02 < figures["com_error_exact"]["mean"] < 0.2
    assert figures["mpjpe"]["largest"] == 0


def test_what_a_table_cannot_tell_is_said(run, folder, own, tmp_path):
    run("evaluate", folder / "near.npz", "--table", "biomech", *own, "-o", tmp_path / "out")
    page = (tmp_path / "out" / "evaluation.md").read_text()
    assert "mIoU, mIoU chosen, CoP chosen: not to be had without a measured pressure map" in page
    assert "CoP error: not to be had without a measured centre of pressure" in page


@pytest.mark.slow
def test_shards_and_a_report_when_all_are_there(run, folder, own, tmp_path, monkeypatch):
    monkeypatch.setattr(job.Job, "piece", 8)
    monkeypatch.setattr(job.Job.__init__, "__defaults__", (*job.Job.__init__.__defaults__[:-1], 8))
    out = tmp_path / "out"
    first = run("evaluate", folder / "near.npz", *own, "-o", out, "--shard", "2/3")
    assert first.code == 0
    assert "1 of 4 pieces are there; the other shards have the rest" in first.out
    assert not (out / "evaluation.md").exists()
    run("evaluate", folder / "near.npz", *own, "-o", out, "--shard", "3/3")
    last = run("evaluate", folder / "near.npz", *own, "-o", out, "--shard", "1/3")
    assert "report:" in last.out
    before = (out / "evaluation.json").read_bytes()
    again = run("evaluate", folder / "near.npz", *own, "-o", out)
    assert "frames in" not in again.out  # nothing is done twice
    assert (out / "evaluation.json").read_bytes() == before
    piece = out / "methods" / "near" / "000001.npz"
    piece.write_bytes(piece.read_bytes()[:1000])
    repaired = run("evaluate", folder / "near.npz", *own, "-o", out)
    assert "000001.npz: is not whole, or of another evaluation; it is measured again" in repaired.err
    assert (out / "evaluation.json").read_bytes() == before


def test_wrong_usage(run, folder, own, tmp_path):
    near, out = folder / "near.npz", ("-o", tmp_path / "out")
    for arguments, said in (
        ([near, *out], "Missing option '--data', the data set, or '--table'"),
        ([near, "--table", "rich", *out], "Missing option '--path', where rich-ipman is"),
        ([near, *own, *out, "--shard", "3/2"], "'3/2' is no shard such as 2/7"),
        ([near, *own, *out, "--shard", "1/2", "--ray"], "--ray does all shards: leave out --shard"),
        ([near, *own, *out, "--option", "camera"], "'camera' is no option such as frame=camera"),
    ):
        done = run("evaluate", *arguments)
        assert done.code == 2
        assert said in " ".join(done.err.split())


def test_files_that_are_wrong(run, folder, own, tmp_path):
    out = "-o", tmp_path / "out"
    for arguments, said in (
        ([tmp_path / "none.npz", *own], "none.npz: there is no such file"),
        ([folder / "near.npz", "--data", "own", "--path", tmp_path / "none.npz"], "none.npz: there is no such file"),
        ([folder / "near.npz", "--data", "moyo", "--path", tmp_path / "none"], "none: there is no such file or folder"),
        ([folder / "near.npz", "--data", "moio", "--path", tmp_path], "data: expected own, or one of 3dpw, amass"),
        ([folder / "near.npz", *own, "--regressor", tmp_path / "none.npy"], "none.npy: the regressor cannot be read"),
    ):
        done = run("evaluate", *arguments, *out)
        assert done.code == 1, arguments
        assert said in done.err
        assert done.err.startswith("ipman: error: ")


def test_the_names_of_tables_are_one(run):
    assert tuple(TABLES) == command.TABLES
    assert all(name in METRICS for table in TABLES.values() for name in table.metrics)
    assert all(name in table.metrics for table in TABLES.values() for row in table.published.values() for name in row)
    assert "ipman evaluate hmr.npz --table rich" in run("evaluate", "--help").out
