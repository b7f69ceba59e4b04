"""Named static poses, as tables of joint angles, and the body standing in them on the floor.

Angles are degrees about x, then y, then z of the parent's axes in the zero pose (T-pose: x to the body's left, y up, z
forward). A name without side means both sides; numbers are those of the left side, the right side mirrors them:

- hip: x negative lifts the thigh forward, y positive turns it out, z positive spreads it; knee: x positive bends;
- ankle: x positive points the toes, `LEVEL` keeps the sole parallel to the floor;
- shoulder: x twists the arm, y negative brings it forward, z negative lowers it; elbow: y negative bends;
- wrist: z positive bends the hand back; pelvis, spine, neck: x positive bends forward, y turns left, z leans right.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from . import joints, rotations

if TYPE_CHECKING:
    from .model import BodyModel

Angles = tuple[float, float, float]
LEVEL: Literal["level"] = "level"

_TABLES: dict[str, Mapping[str, Angles | Literal["level"]]] = {
    "standing": {
        "hip": (0, 0, -4),
        "ankle": LEVEL,
        "shoulder": (0, 0, -75),
        "elbow": (0, -15, 0),
    },
    "t_pose": {},
    "a_pose": {"shoulder": (0, 0, -45)},
    "walking": {
        "left_hip": (-22, 0, -6),
        "left_knee": (5, 0, 0),
        "left_ankle": LEVEL,
        "right_hip": (18, 0, -6),
        "right_knee": (15, 0, 0),
        "right_ankle": (-13, 0, 0),
        "right_foot": (-20, 0, 0),
        "left_shoulder": (0, 20, -75),
        "right_shoulder": (0, -25, -75),
        "elbow": (0, -25, 0),
    },
    "one_leg": {
        "left_hip": (0, 0, -14),
        "left_ankle": LEVEL,
        "right_hip": (-85, 0, 0),
        "right_knee": (90, 0, 0),
        "shoulder": (0, 0, -30),
    },
    "tree": {
        "left_hip": (0, 0, -15),
        "left_ankle": LEVEL,
        "right_hip": (0, 92, 58),
        "right_knee": (112, 0, 0),
        "right_ankle": (36, 0, 0),
        "collar": (0, 0, 20),
        "shoulder": (0, 0, 67),
    },
    "warrior": {
        "left_hip": (-65, 80, 0),
        "left_knee": (65, 0, 0),
        "left_ankle": LEVEL,
        "right_hip": (0, 0, 41),
        "right_ankle": LEVEL,
        "neck": (0, 30, 0),
        "head": (0, 40, 0),
    },
    "lunge": {
        "left_hip": (-50, 0, -5),
        "left_knee": (52, 0, 0),
        "left_ankle": LEVEL,
        "right_hip": (25, 0, -5),
        "right_knee": (30, 0, 0),
        "right_ankle": (-15, 0, 0),
        "right_foot": (-40, 0, 0),
        "shoulder": (0, 0, -75),
        "elbow": (0, -15, 0),
    },
    "chair": {
        "pelvis": (35, 0, 0),
        "hip": (-95, 0, -4),
        "knee": (75, 0, 0),
        "ankle": LEVEL,
        "shoulder": (0, -40, 55),
    },
    "squat": {
        "pelvis": (40, 0, 0),
        "hip": (-140, 15, 5),
        "knee": (125, 0, 0),
        "ankle": LEVEL,
        "shoulder": (0, -85, 0),
    },
    "lean_past_toes": {
        "pelvis": (18, 0, 0),
        "hip": (0, 0, -4),
        "ankle": LEVEL,
        "shoulder": (0, 0, -75),
    },
    "kneeling": {
        "pelvis": (-5, 0, 0),
        "knee": (89, 0, 0),
        "ankle": (63, 0, 0),
        "shoulder": (0, 0, -75),
        "elbow": (0, -15, 0),
    },
    "all_fours": {
        "pelvis": (75, 0, 0),
        "hip": (-75, 0, -4),
        "knee": (85, 0, 0),
        "ankle": (62, 0, 0),
        "shoulder": (90, -75, -90),
        "wrist": (0, 0, 85),
    },
    "plank": {
        "pelvis": (71, 0, 0),
        "ankle": (-20, 0, 0),
        "foot": (-50, 0, 0),
        "shoulder": (90, -72, -90),
        "wrist": (0, 0, 85),
    },
    "push_up": {
        "pelvis": (82, 0, 0),
        "ankle": (-10, 0, 0),
        "foot": (-60, 0, 0),
        "shoulder": (0, -10, -20),
        "elbow": (0, -85, 0),
        "wrist": (0, 0, 85),
    },
    "cobra": {
        "pelvis": (85, 0, 0),
        "hip": (0, 0, -4),
        "ankle": (55, 0, 0),
        "spine1": (-26, 0, 0),
        "spine2": (-26, 0, 0),
        "spine3": (-26, 0, 0),
        "neck": (-10, 0, 0),
        "shoulder": (0, 25, -80),
        "elbow": (80, -65, 0),
        "wrist": (0, 0, 70),
    },
    "sitting": {
        "pelvis": (-2, 0, 0),
        "hip": (-87, 0, -2),
        "shoulder": (0, -15, -72),
        "elbow": (0, -35, 0),
    },
    "lying": {
        "pelvis": (-90, 0, 0),
        "hip": (2, 0, 0),
        "spine1": (-2, 0, 0),
        "spine2": (-2, 0, 0),
        "neck": (-5, 0, 0),
        "ankle": (20, 0, 0),
        "shoulder": (0, 10, -65),
        "elbow": (0, -5, 0),
    },
}

NAMES = tuple(_TABLES)


def pose(name: str) -> NDArray[np.float64]:
    """Axis-angle pose (24, 3) in radians, joints in SMPL's order. Raises ValueError listing the names."""
    if name not in _TABLES:
        raise ValueError(f"no pose {name!r}; there are {', '.join(NAMES)}")
    from scipy.spatial.transform import Rotation

    local = np.tile(np.eye(3), (len(joints.SMPL), 1, 1))
    level = []
    for key, angles in _TABLES[name].items():
        for index, side in _joints_of(key):
            if angles == LEVEL:
                level.append(index)
            else:
                local[index] = Rotation.from_euler("xyz", np.multiply(angles, side), degrees=True).as_matrix()
    for index in level:
        local[index] = _levelling(_world_rotation(local, joints.SMPL_PARENTS[index]))
    return Rotation.from_matrix(local).as_rotvec()


def pose_of(body: BodyModel, name: str) -> NDArray[np.float64]:
    """The pose `name` (J, 3) of a body, whose joints beyond SMPL's 24 stay as they are at zero."""
    table = pose(name)
    full = np.zeros((body.num_joints, 3))
    for index, joint in enumerate(joints.SMPL):
        if joint in body.joint_names:
            full[body.joint_names.index(joint)] = table[index]
    return full


def posed(body: BodyModel, name: str, betas: ArrayLike | None = None) -> NDArray[np.floating]:
    """Vertices (..., V, 3) of `body` in the pose `name`, its lowest vertex on the floor y = 0.

    `betas` (..., B) as in `BodyModel.forward`. Bodies with other joints than SMPL's 24 take the joints they share.
    """
    vertices = body(pose_of(body, name), betas).vertices
    vertices[..., 1] -= vertices[..., 1].min(-1, keepdims=True)
    return vertices


def _joints_of(key: str) -> list[tuple[int, Angles]]:
    """Indices of the joints that a key of a table means, with the signs that mirror its angles to that side."""
    same, mirrored = (1, 1, 1), (1, -1, -1)
    if key in joints.SMPL:
        return [(joints.SMPL.index(key), mirrored if key.startswith("right_") else same)]
    return [(joints.SMPL.index(f"left_{key}"), same), (joints.SMPL.index(f"right_{key}"), mirrored)]


def _world_rotation(local: NDArray[np.float64], joint: int) -> NDArray[np.float64]:
    """Product of the local rotations from the root down to `joint`."""
    rotation = local[joint]
    while (joint := joints.SMPL_PARENTS[joint]) >= 0:
        rotation = local[joint] @ rotation
    return rotation


def _levelling(parent: NDArray[np.float64]) -> NDArray[np.float64]:
    """The local rotation under `parent` (3, 3) that makes its y axis vertical again and keeps its heading."""
    up = parent[:, 1]
    axis = np.cross(up, [0.0, 1.0, 0.0])
    sine = np.linalg.norm(axis)
    if sine == 0.0:
        return np.eye(3)
    upright = rotations.from_axis_angle(axis / sine * np.arctan2(sine, up[1]))
    return parent.T @ upright @ parent
