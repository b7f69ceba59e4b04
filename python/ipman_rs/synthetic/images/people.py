"""People at rest on the floor y = 0, turned any way, and some who are not at rest: tipped over, or in the air.

As in `ipman_rs.synthetic.at_rest`, of which the families of poses, their perturbation and the settling come, but
the people have the embedded body's own betas.
"""

from __future__ import annotations

import dataclasses
from functools import cache

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from ipman_rs.body import BodyModel, load_body, poses
from ipman_rs.body.landmarks import point_rows, skin_points
from ipman_rs.synthetic.at_rest import FAMILIES, TRIES, PosedPerson, disturb, perturb, settle

Array = NDArray[np.floating]

LARGEST_BETA = 2.5
PLACE = 1.0  # m, the pelvis is within this square of the world's origin
KINDS = ("static", "tipped", "jumping")
UPSET = {"standing", "one leg", "lunge", "crouch"}  # families that can be tipped over or jump


@dataclasses.dataclass(frozen=True)
class DrawnPerson:
    """A person: float32 pose (24, 3) with the root in the world (y up, the floor at y = 0), betas (10,), transl (3,) m.

    kind: "static", "tipped" or "jumping".
    """

    body: str
    family: str
    pose_name: str
    kind: str
    pose: Array
    betas: Array
    transl: Array

    def posed(self) -> tuple[Array, Array]:
        """Vertices (V, 3) and joints (24, 3), float64 m, of the parameters as they are written."""
        body = load_body(self.body)(*(np.float64(value) for value in (self.pose, self.betas, self.transl)))
        return body.vertices, body.joints


def draw_person(draw: np.random.Generator, body: str, family: str, moving: float) -> DrawnPerson:
    """A new person in a pose of the family; `moving` is the probability that it is not at rest, where it can be."""
    model = load_body(body)
    scene = None
    while scene is None:  # a shape that does not find its balance is drawn again, pose and all
        betas = draw.standard_normal(model.num_betas).clip(-LARGEST_BETA, LARGEST_BETA).astype(np.float32)
        scene = draw_at_rest(draw, with_shape(model, betas.astype(np.float64)), family)
    upset = draw.random() < moving and family in UPSET
    kind = KINDS[draw.integers(1, len(KINDS))] if upset else "static"
    scene = disturb(scene, kind, draw)
    heading = Rotation.from_rotvec([0.0, draw.uniform(-np.pi, np.pi), 0.0])
    pose, transl = scene.full_pose.copy(), scene.transl.copy()
    pose[0] = (heading * Rotation.from_rotvec(pose[0])).as_rotvec()
    transl[[0, 2]] += draw.uniform(-PLACE, PLACE, 2)
    return DrawnPerson(body, family, scene.name, kind, pose.astype(np.float32), betas, transl.astype(np.float32))


def draw_at_rest(draw: np.random.Generator, person: BodyModel, family: str) -> PosedPerson | None:
    """The person in a pose of the family; None if many tries do not stand."""
    template = load_body(person.name).template
    name = FAMILIES[family][draw.integers(len(FAMILIES[family]))]
    for _ in range(TRIES):
        settled = settle(perturb(poses.pose_of(person, name), person, draw), person, template)
        if settled is not None:
            return PosedPerson(person, template, family, name, *settled)
    return None


def with_shape(model: BodyModel, betas: Array) -> BodyModel:
    """The model with this shape and no betas any more."""
    return dataclasses.replace(
        model,
        v_template=model.v_template + model.shapedirs @ betas,
        shapedirs=np.zeros((model.num_vertices, 3, 0)),
        J_template=model.J_template + model.J_shapedirs @ betas,
        J_shapedirs=np.zeros((model.num_joints, 3, 0)),
    )


@cache
def keypoint_names(body: str) -> tuple[str, ...]:
    """The 24 joints, then the named points of the skin (`ipman_rs.body.landmarks`)."""
    model = load_body(body)
    return tuple(dict.fromkeys([*model.joint_names, *skin_points(model)]))


def keypoints(body: str, vertices: Array, joints: Array) -> Array:
    """The points (K, 3) m in the order of `keypoint_names`."""
    rows = point_rows(load_body(body))
    return np.concatenate([vertices, joints])[[rows[name] for name in keypoint_names(body)]]
