"""People at rest on the floor y = 0, and the same people tipped over or in the air.

A named pose (`ipman_rs.body.poses`) is perturbed joint by joint, and the stiff body is laid on the floor: of the facets
of its convex hull over which its exact centre of mass lies, it rests on the one that needs the least tilt. A
body that would have to tilt too far, or is not supported by its samples within 1 cm of the floor, is drawn again.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import ConvexHull
from scipy.spatial.transform import Rotation

import ipman_rs as ip
from ipman_rs.body import BodyModel, load_body, poses
from ipman_rs.body.model import BodyOutput

from .people import Draw, person

Array = NDArray[np.floating]

FAMILIES: dict[str, tuple[str, ...]] = {
    "standing": ("standing", "a_pose", "t_pose", "walking"),
    "one leg": ("one_leg", "tree"),
    "lunge": ("lunge", "warrior"),
    "crouch": ("chair", "squat"),
    "kneeling": ("kneeling",),
    "hands and feet": ("all_fours", "plank", "push_up"),
    "sitting, lying": ("sitting", "lying", "cobra"),
}
# Degrees, of each number of a rotation vector: of most joints, those of the legs, and the root.
SPREADS = (8.0, 4.0, 3.0)
FARTHEST_TILT = 12.0  # degrees
CLOSE = 0.01  # m
TRIES = 400
TIPPED, RAISED = (15.0, 30.0), (0.15, 0.40)  # degrees, m


@dataclasses.dataclass(frozen=True)
class PosedPerson:
    """A posed person: body model and template, full_pose (24, 3), transl (3,), and from these vertices (V, 3) and
    joints (24, 3)."""

    person: BodyModel
    template: ip.BodyTemplate
    family: str
    name: str
    full_pose: Array
    transl: Array

    @property
    def vertices(self) -> Array:
        return np.asarray(self.person(self.full_pose, transl=self.transl).vertices)

    @property
    def joints(self) -> Array:
        return np.asarray(self.person(self.full_pose, transl=self.transl).joints)


def draw_people(
    count: int, seed: int, kind: str = "balanced", progress: Callable[[int], None] | None = None
) -> list[PosedPerson]:
    """`count` people, the families in turn. The same seed draws the same people in the same poses for every kind:
    "balanced", "tipped" (standing families turned 15° to 30° about a level axis) or "jumping" (raised by 15 to 40 cm).
    """
    scenes = []
    for index in range(count):
        draw = np.random.default_rng([seed, index])
        family = list(FAMILIES)[index % len(FAMILIES)] if kind == "balanced" else ("standing", "crouch")[index % 2]
        scene = at_rest(family, draw)
        scenes.append(disturb(scene, kind, draw))
        if progress is not None:
            progress(index + 1)
    return scenes


def at_rest(family: str, draw: Draw) -> PosedPerson:
    """A new person in one of the poses of a family. RuntimeError if none of many tries stands."""
    body = person(draw)
    names = FAMILIES[family]
    template = ip.BodyTemplate(body().vertices, body.faces, load_body("anny").face_parts, body.part_names)
    name = names[draw.integers(len(names))]
    for _ in range(TRIES):
        pose = perturb(poses.pose_of(body, name), body, draw)
        settled = settle(pose, body, template)
        if settled is not None:
            return PosedPerson(body, template, family, name, *settled)
    raise RuntimeError(f"{name}: none of {TRIES} tries came to rest within {FARTHEST_TILT:g} degrees")


def perturb(pose: Array, body: BodyModel, draw: Draw, spreads: tuple[float, float, float] = SPREADS) -> Array:
    most, legs, root = spreads
    spread = np.full(body.num_joints, most)
    for index, name in enumerate(body.joint_names):
        if name.partition("_")[2] in ("hip", "knee", "ankle", "foot"):
            spread[index] = legs
    spread[0] = root
    return pose + np.radians(spread)[:, None] * draw.standard_normal(pose.shape)


def settle(pose: Array, body: Callable[[Array], BodyOutput], template: ip.BodyTemplate) -> tuple[Array, Array] | None:
    """The pose tilted onto the floor with its translation, or None if it would tip over. body: of a pose."""
    vertices = np.asarray(body(pose).vertices)
    com = np.asarray(ip.center_of_mass(vertices, template, "exact"))
    tilt = rest_rotation(vertices, com)
    if tilt is None:
        return None
    pose = pose.copy()
    pose[0] = (tilt * Rotation.from_rotvec(pose[0])).as_rotvec()
    vertices = np.asarray(body(pose).vertices)
    transl = np.array([0.0, -vertices[:, 1].min(), 0.0])
    margin = ip.support_margin(vertices + transl, template, ip.Ground.y_up(), CLOSE, "exact")
    return (pose, transl) if margin >= 0 else None


def rest_rotation(vertices: Array, com: Array) -> Rotation | None:
    """The smallest turn that makes a facet of the hull under the centre of mass level, if it is small."""
    hull = ConvexHull(vertices)
    normals = hull.equations[:, :3]
    down = np.array([0.0, -1.0, 0.0])
    tilts = np.degrees(np.arccos((normals @ down).clip(-1, 1)))
    for facet in np.argsort(tilts):
        if tilts[facet] > FARTHEST_TILT:
            return None
        if lies_over(com, vertices[hull.simplices[facet]], normals[facet]):
            return Rotation.align_vectors(down, normals[facet])[0]
    return None


def lies_over(point: Array, triangle: Array, normal: Array) -> bool:
    """Whether a point lies over a triangle, seen along its normal."""
    sides = [normal @ np.cross(triangle[(i + 1) % 3] - triangle[i], point - triangle[i]) for i in range(3)]
    return bool(min(sides) >= 0 or max(sides) <= 0)


def disturb(scene: PosedPerson, kind: str, draw: Draw) -> PosedPerson:
    if kind == "jumping":
        return dataclasses.replace(scene, transl=scene.transl + [0.0, draw.uniform(*RAISED), 0.0])
    if kind == "tipped":
        heading, angle = draw.uniform(0, 2 * np.pi), np.radians(draw.uniform(*TIPPED))
        turn = Rotation.from_rotvec(angle * np.array([np.cos(heading), 0.0, np.sin(heading)]))
        pose = scene.full_pose.copy()
        pose[0] = (turn * Rotation.from_rotvec(pose[0])).as_rotvec()
        lowest = np.asarray(scene.person(pose).vertices)[:, 1].min()
        return dataclasses.replace(scene, full_pose=pose, transl=np.array([0.0, -lowest, 0.0]))
    return scene
