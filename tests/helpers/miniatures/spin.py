"""Miniature files in SPIN's form, with IPMAN's additions, written from the form's description: a person of sticks.

The order of the 24 joints is SPIN's: right leg upwards, left leg downwards, right arm, left arm, the middle, the face.
"""

from __future__ import annotations

import numpy as np

from . import stick

J24 = [
    "right_ankle", "right_knee", "right_hip", "left_hip", "left_knee", "left_ankle",
    "right_wrist", "right_elbow", "right_shoulder", "left_shoulder", "left_elbow", "left_wrist",
    "neck", "head_top", "pelvis", "thorax", "spine", "jaw", "head", "nose",
    "left_eye", "right_eye", "left_ear", "right_ear",
]  # fmt: skip
H36M_17 = [14, 3, 4, 5, 2, 1, 0, 16, 12, 17, 18, 9, 10, 11, 8, 7, 6]  # those of J24 that Human3.6M has
LSP_14 = list(range(14))
COCO_17 = [19, 20, 21, 22, 23, 9, 8, 10, 7, 11, 6, 3, 2, 4, 1, 5, 0]
MPII_16 = [0, 1, 2, 3, 4, 5, 14, 15, 12, 13, 6, 7, 8, 9, 10, 11]


def rows(count, known, up=(0.0, 0.0, 1.0), floor=0.0, eye_height=1.5, seed=0):
    """Arrays of `count` people in front of cameras that stand around them, and the truth behind them.

    Camera and world as in X_c = R X_w + t, metres; the truth has `t`, `joints` in the world and `seen` by the camera.
    """
    rng = np.random.default_rng(seed)
    side, front = stick.axes(up, 0.0)[0], stick.axes(up, 0.0)[2]
    focal, centre = 1145.0, (512.0, 515.0)

    def on_floor(a, b, height):
        return [a * side[i] + b * front[i] + (floor + height) * up[i] for i in range(3)]

    arrays = {name: [] for name in ("part", "S", "S_world", "center", "scale", "cam_r", "cam_k", "pose_world")}
    truth = {"t": [], "joints": [], "seen": [], "feet": []}
    for _ in range(count):
        feet = on_floor(*rng.uniform(-1, 1, 2), 0.0)
        heading, around = rng.uniform(0, 2 * np.pi, 2)
        eye = on_floor(5 * np.cos(around), 5 * np.sin(around), eye_height)
        rotation, t = stick.camera(eye, on_floor(0, 0, 0.9), up)
        part, world, camera = np.zeros((24, 3)), np.zeros((24, 4)), np.zeros((24, 4))
        points = {}
        for j in known:
            points[j] = stick.joint(J24[j], feet, up, heading)
            part[j] = [*stick.pixel(points[j], rotation, t, focal, centre), 1.0]
            world[j] = [*points[j], 1.0]
        pelvis = stick.seen(stick.joint("pelvis", feet, up, heading), rotation, t)
        for j in known:
            camera[j] = [*(a - b for a, b in zip(stick.seen(points[j], rotation, t), pelvis, strict=True)), 1.0]
        centre_of_box, scale = stick.box([part[j, :2] for j in known])
        pose = np.zeros(72)
        pose[:3] = stick.root(up, heading)
        given = (
            part,
            camera,
            world,
            centre_of_box,
            scale,
            rotation,
            [[focal, 0, centre[0]], [0, focal, centre[1]], [0, 0, 1]],
            pose,
        )
        for name, value in zip(arrays, given, strict=True):
            arrays[name].append(value)
        for name, value in (("t", t), ("joints", world[:, :3]), ("seen", camera[:, :3]), ("feet", feet)):
            truth[name].append(value)
    return {name: np.array(value) for name, value in arrays.items()}, {n: np.array(v) for n, v in truth.items()}


def save(file, arrays, changes=(), packed=False):
    """The `.npz`, with some arrays changed, or left out where the change is None."""
    arrays = {name: value for name, value in (arrays | dict(changes)).items() if value is not None}
    (np.savez_compressed if packed else np.savez)(file, **arrays)
    return file
