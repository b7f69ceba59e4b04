"""Bodies that the numpy tests share."""

from __future__ import annotations

import os
from pathlib import Path

import numpy as np
import pytest
import trimesh

import ipman_rs as ip
from tests.helpers import solids


@pytest.fixture
def rng():
    return np.random.default_rng(20)


@pytest.fixture(scope="session")
def anny():
    return ip.load_body("anny")


@pytest.fixture(scope="session")
def lite():
    return ip.load_body("anny-lite")


@pytest.fixture(scope="session")
def blob():
    return solids.blob()


@pytest.fixture(scope="session")
def bodies(blob):
    """Six bodies of the blob, (6, V, 3)."""
    posed = solids.posed(blob, 6)
    posed.setflags(write=False)
    return posed


@pytest.fixture(scope="session")
def random_people():
    """random_people(model, count, seed) -> (count, V, 3): random shapes and poses, lowest vertex on y = 0."""

    def make(model, count, seed):
        rng = np.random.default_rng(seed)
        pose = rng.normal(scale=0.3, size=(count, model.num_joints, 3))
        pose[:, 0] = rng.normal(scale=0.6, size=(count, 3))
        vertices = model(pose, rng.normal(size=(count, model.num_betas))).vertices
        vertices[..., 1] -= vertices[..., 1].min(axis=-1, keepdims=True)
        return vertices

    return make


@pytest.fixture(scope="session")
def shared():
    """shared("photo") -> that folder of real data; skips, saying so, without it."""
    root = os.environ.get("IPMAN_SHARED_DATA") or Path(__file__).resolve().parents[2] / "shared" / "data"

    def folder(name):
        path = Path(root) / name
        if not path.is_dir():
            pytest.skip(f"{name} is not at {root}: set IPMAN_SHARED_DATA")
        return path

    return folder


@pytest.fixture(scope="session")
def real_people(shared):
    """Two people reconstructed from photos, (2, V, 3) metres in a y-down camera frame, and their faces."""
    folder = shared("mhr_bodies")
    faces = np.array(trimesh.load(folder / "mhr_face_mask.ply", process=False).faces)
    vertices = np.stack([np.load(folder / f"img_subj0{index}.npz")["pred_vertices"] for index in range(2)])
    return vertices.astype(np.float64), faces
