"""The bodies that are measured: 1,229, 6,890 and 12,272 vertices, and batches of their poses.

The one in the middle has SMPL's counts, 6,890 vertices and 13,776 faces: the embedded body decimated by quadric edge
collapse. Its skinning weights, and by them its parts, and its shapes are those of the full body's nearest vertices.
"""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import torch
from numpy.typing import NDArray

import ipman_rs as ip
from ipman_rs.body import BodyModel
from ipman_rs.body.poses import pose as named_pose

CACHE = Path(__file__).resolve().parents[1] / "out" / "benchmark"
VERTICES = {"lite": 1_229, "smpl": 6_890, "full": 12_272}
SMPL_FACES = 13_776


@cache
def body(name: str) -> BodyModel:
    """One of VERTICES."""
    return _smpl_sized() if name == "smpl" else ip.load_body({"lite": "anny-lite", "full": "anny"}[name])


def posed_batch(model: BodyModel, batch: int, seed: int = 0) -> NDArray[np.float64]:
    """Slightly different poses whose feet reach a centimetre into the ground: (batch, V, 3)."""
    vertices = model(poses(model, batch, seed)).vertices
    vertices[..., 1] -= vertices[..., 1].min(axis=-1, keepdims=True) + 0.01
    return vertices.astype(np.float64)


def poses(model: BodyModel, batch: int, seed: int = 0) -> NDArray[np.float64]:
    """Around standing upright: (batch, J, 3) axis-angle."""
    rng = np.random.default_rng(seed)
    return named_pose("standing") + rng.normal(scale=0.1, size=(batch, model.num_joints, 3))


def vertices_of(name: str, batch: int) -> torch.Tensor:
    """A batch as a float32 leaf that asks for a gradient."""
    return torch.tensor(posed_batch(body(name), batch), dtype=torch.float32, requires_grad=True)


def _smpl_sized() -> BodyModel:
    stored = CACHE / "body-6890.npz"
    if not stored.exists():
        CACHE.mkdir(parents=True, exist_ok=True)
        np.savez_compressed(stored, allow_pickle=False, **_decimated(ip.load_body("anny")))
    arrays = dict(np.load(stored))
    return replace(ip.load_body("anny"), name="smpl-sized", expressiondirs=np.zeros((6_890, 3, 0)), **arrays)


def _decimated(full: BodyModel) -> dict[str, NDArray]:
    import fast_simplification
    import trimesh
    from scipy.spatial import KDTree

    simplified = fast_simplification.simplify(full.v_template, full.faces.astype(np.int32), target_count=SMPL_FACES)
    vertices, faces = simplified[:2]
    mesh = trimesh.Trimesh(vertices, faces, process=False)
    if not (mesh.is_watertight and mesh.is_winding_consistent and mesh.euler_number == 2 and mesh.volume > 0):
        raise RuntimeError("the decimated body is no closed surface")
    if (len(vertices), len(faces)) != (VERTICES["smpl"], SMPL_FACES):
        raise RuntimeError(f"the decimated body has {len(vertices)} vertices and {len(faces)} faces")
    _, nearest = KDTree(full.v_template).query(vertices)
    return {
        "v_template": vertices,
        "faces": faces.astype(np.int64),
        "weights": full.weights[nearest],
        "shapedirs": full.shapedirs[nearest],
    }
