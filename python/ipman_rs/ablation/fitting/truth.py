"""The true bodies of posed people, as arrays with one row per person."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from functools import cache
from pathlib import Path

import numpy as np
import torch
from numpy.typing import NDArray
from scipy.spatial import KDTree
from trimesh.triangles import closest_point, points_to_barycentric

import ipman_rs as ip
import ipman_rs.torch as ipt
from ipman_rs.body import BodyModel, load_body
from ipman_rs.files import atomic_write

from ...fitting.landmarks import Landmarks, landmark_names
from ...synthetic.at_rest import PosedPerson

Array = NDArray[np.floating]

FITTED = "anny-lite"  # the body that is fitted
NEAREST = 8  # vertices whose faces are tried for the nearest point
DENSITY = 985.0  # kg/m³


@dataclasses.dataclass(frozen=True)
class Truth:
    """n people; V vertices of the fitted body, K its landmarks."""

    family: Array  # (n,) str
    pose: Array  # (n, 24, 3), the root first
    joints: Array  # (n, 24, 3) m
    surface: Array  # (n, V, 3) m, the points that correspond to the fitted body's vertices
    resting: Array  # (n, V, 3) m, the same in the zero pose
    landmarks: Array  # (n, K, 3) m
    height: Array  # (n,) m, in the zero pose
    mass: Array  # (n,) kg
    lowest: Array  # (n,) m, above the floor
    margin_10: Array  # (n,) m, of the exact centre of mass inside the base of support within 10 cm of the floor
    margin_3: Array  # (n,) m, within 3 cm

    def __len__(self) -> int:
        return len(self.family)

    @classmethod
    def of(cls, scenes: Sequence[PosedPerson]) -> Truth:
        rows = [_row(scene) for scene in scenes]
        return cls(**{field.name: np.array([row[field.name] for row in rows]) for field in dataclasses.fields(cls)})

    def save(self, path: Path) -> None:
        with atomic_write(path) as file:
            np.savez_compressed(file, **vars(self))

    @classmethod
    def load(cls, path: Path) -> Truth:
        with np.load(path, allow_pickle=False) as stored:
            return cls(**{field.name: stored[field.name] for field in dataclasses.fields(cls)})


def _row(scene: PosedPerson) -> dict[str, object]:
    body, floor = scene.person, ip.Ground.y_up()
    vertices, resting = scene.vertices, np.asarray(body().vertices)
    landmarks = Landmarks(ipt.BodyModel(body, torch.float64), landmark_names(load_body(FITTED)))
    points = landmarks(torch.from_numpy(scene.full_pose)[None], None, torch.from_numpy(scene.transl)[None])
    volume = np.asarray(ip.part_volumes(resting, scene.template)).sum()
    return {
        "family": scene.family,
        "pose": scene.full_pose,
        "joints": scene.joints,
        "surface": corresponding_points(vertices),
        "resting": corresponding_points(resting),
        "landmarks": points[0].numpy(),
        "height": np.ptp(resting[:, 1]),
        "mass": DENSITY * volume,
        "lowest": vertices[:, 1].min(),
        "margin_10": ip.support_margin(vertices, scene.template, floor, 0.10, "exact"),
        "margin_3": ip.support_margin(vertices, scene.template, floor, 0.03, "exact"),
    }


def corresponding_points(vertices: Array) -> Array:
    """Of a mesh of `anny` (12272, 3), the points (V, 3) that correspond to the fitted body's vertices."""
    corners, weights = correspondence()
    return (vertices[corners] * weights[..., None]).sum(axis=1)


@cache
def correspondence() -> tuple[NDArray[np.int64], Array]:
    """Vertices of `anny` (V, 3) and their weights (V, 3): the points of its resting mean surface that are nearest to
    the fitted body's vertices."""
    full, lite = load_body("anny"), load_body(FITTED)
    near = np.asarray(KDTree(full.v_template).query(lite.v_template, NEAREST)[1])
    corners, weights = [], []
    for point, vertices in zip(lite.v_template, near, strict=True):
        faces = full.faces[np.isin(full.faces, vertices).any(axis=1)]
        triangles = full.v_template[faces]
        closest = closest_point(triangles, np.tile(point, (len(faces), 1)))
        best = np.linalg.norm(closest - point, axis=1).argmin()
        corners.append(faces[best])
        weights.append(points_to_barycentric(triangles[best : best + 1], closest[best : best + 1])[0])
    return np.array(corners), np.array(weights)


def error_floors(truth: Truth) -> dict[str, float]:
    """Errors, mm, that no fit can avoid. correspondence: of the mean body in the zero pose, fitted body against
    corresponding points; shape: what is left of the people's resting surfaces after the best betas and translation."""
    lite: BodyModel = load_body(FITTED)
    mean = np.asarray(lite().vertices)
    same = np.linalg.norm(corresponding_points(np.asarray(load_body("anny")().vertices)) - mean, axis=-1).mean()
    unit = np.eye(lite.num_betas)
    slopes = np.stack([np.asarray(lite(betas=beta).vertices) - mean for beta in unit], axis=-1)
    shifts = np.tile(np.eye(3), (len(mean), 1, 1))
    basis = np.concatenate([slopes, shifts], axis=-1).reshape(-1, lite.num_betas + 3)
    wanted = (truth.resting - mean).reshape(len(truth), -1)
    left = wanted.T - basis @ np.linalg.lstsq(basis, wanted.T, rcond=None)[0]
    out = np.linalg.norm(left.T.reshape(len(truth), -1, 3), axis=-1).mean()
    return {"correspondence": 1e3 * float(same), "shape": 1e3 * float(out)}
