"""Files that the tests of the command line write and read."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np


def strict(text: str):
    """Parse JSON that must not hold NaN or Infinity, which strict parsers refuse."""

    def refuse(word: str):
        raise AssertionError(f"{word} is no JSON")

    return json.loads(text, parse_constant=refuse)


def report(folder: Path):
    return strict((folder / "report.json").read_text(encoding="utf-8"))


def walk_parameters(frames: int = 8) -> dict[str, np.ndarray]:
    """A made-up AMASS file: a body that bends its knees, z up."""
    poses = np.zeros((frames, 156))
    poses[:, 0] = np.pi / 2  # the root turns the model's y up to the world's z up
    poses[:, 3 * 4] = poses[:, 3 * 5] = np.linspace(0, 0.6, frames)
    poses[:, 3 * 30] = 0.3  # a finger, which the embedded body does not have
    trans = np.zeros((frames, 3))
    trans[:, 0] = np.linspace(0, 0.4, frames)
    trans[:, 2] = 0.9
    return {
        "poses": poses,
        "trans": trans,
        "betas": np.full(16, 0.5),
        "mocap_framerate": np.array(20.0),
        "gender": np.array("neutral"),
    }
