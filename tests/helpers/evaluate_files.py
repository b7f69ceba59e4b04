"""Small files of truth and predictions, made by hand, and a command run in a process of its own."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np

import ipman_rs as ip
from ipman_rs.body import poses
from ipman_rs.evaluation.tables import Job, Shard, Source
from ipman_rs.evaluation.tables import report as reports
from ipman_rs.evaluation.tables.summary import difference, summarise

FRAMES, PIECE = 300, 40  # eight pieces, the last of 20


def truth(frames: int = FRAMES, seed: int = 0) -> dict[str, Any]:
    """Named poses with noise, their lowest vertex near the floor y = 0; ten frames a sequence."""
    draw = np.random.default_rng(seed)
    named = np.stack([poses.pose(name) for name in poses.NAMES])[np.arange(frames) // 10 % len(poses.NAMES)]
    pose = (named + 0.05 * draw.standard_normal(named.shape)).astype(np.float32)
    betas = (0.3 * draw.standard_normal((frames, 10))).astype(np.float32)
    transl = np.zeros((frames, 3), np.float32)
    transl[:, 1] = -ip.load_body("anny-lite")(pose, betas).vertices[..., 1].min(axis=1) - 0.005
    return {
        "names": np.array([f"walk{k // 10}/{k % 10:04d}" for k in range(frames)]),
        "sequences": np.array([f"walk{k // 10}" for k in range(frames)]),
        "body": "anny-lite",
        "pose": pose,
        "betas": betas,
        "transl": transl,
        "ground": np.array([0.0, 1.0, 0.0, 0.0]),
    }


def predictions(true: dict[str, Any], noise: float = 0.1, seed: int = 1) -> dict[str, Any]:
    draw = np.random.default_rng(seed)
    pose = true["pose"] + noise * draw.standard_normal(true["pose"].shape)
    transl = true["transl"] + noise / 5 * draw.standard_normal(true["transl"].shape)
    found = {"names": true["names"], "body": true["body"], "betas": true["betas"]}
    return found | {"pose": pose.astype(np.float32), "transl": transl.astype(np.float32)}


def save(path: Path, arrays: dict[str, Any]) -> Path:
    np.savez(path, **arrays)
    return path


def job(folder: Path, predicted: Path, true: Path, **options: Any) -> Job:
    return Job(predicted.stem, str(predicted), Source("own", str(true)), str(folder), **{"piece": PIECE, **options})


def finish(jobs: list[Job], shard: Shard | None = None) -> dict[str, Any]:
    """Does what is missing and writes the report; its record."""
    for each in jobs:
        each.begin()
        each.run(shard or Shard())
    return write(jobs)


def write(jobs: list[Job]) -> dict[str, Any]:
    """The files of the report but the pictures, which take a second."""
    found = [summarise(each) for each in jobs]
    differences = [difference(each, jobs[0]) for each in jobs[1:]]
    folder = Path(jobs[0].folder)
    report = reports.Report("test", "made", found, differences)
    for name, text in reports.texts(report).items():
        (folder / name).write_text(text)
    reports.write_frames(folder / "frames.parquet", report, jobs, lambda frames: None)
    return json.loads((folder / "evaluation.json").read_text())


def content(folder: Path) -> dict[str, bytes]:
    """Every file of a report, and every piece."""
    names = ("evaluation.json", "evaluation.csv", "evaluation.md", "sequences.csv")
    files = [*(folder / name for name in names), *sorted(folder.glob("methods/*/*.npz"))]
    return {str(file.relative_to(folder)): file.read_bytes() for file in files}


def process(script: str, *arguments: str) -> subprocess.Popen[str]:
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join(sys.path)}
    return subprocess.Popen(
        [sys.executable, "-c", script, *arguments], env=environment, text=True,
        stdout=subprocess.PIPE, stderr=subprocess.PIPE,
    )  # fmt: skip
