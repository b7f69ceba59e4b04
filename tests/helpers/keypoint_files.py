"""Keypoint files of bodies whose poses are known, for the tests of `ipman fit`."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np

import ipman_rs as ip
from ipman_rs.data.keypoints import mediapipe

SIZE = (480, 640)
FOCAL = float(np.hypot(*SIZE))

QUICK = """\
solver: levenberg
tolerance: {gradient: 0.1, decrease: 0.5}
start: {search: body, yaws: 1, iterations: 8}
stages:
  - name: pose
    free: [orient, transl, pose, betas]
    iterations: 4
    weights: &weights {reprojection: 4, pose_prior: 20, joint_limits: 200, shape_prior: 25}
  - name: physics
    free: [orient, transl, pose, betas]
    iterations: 2
    find_ground: true
    weights: {<<: *weights, balance: 1.0e+3, ground: 1.0e+4}
"""


def seen(pose: str = "standing", depth: float = 4.0, body: str = "anny-lite") -> np.ndarray:
    """MediaPipe's landmarks (33, 4) of a body in a named pose before a level camera, relative to the image."""
    import torch

    import ipman_rs.torch as ipt
    from ipman_rs.fitting.landmarks import Landmarks, landmark_names

    model = ipt.BodyModel(body)
    names = [name for name in mediapipe.NAMES if name is not None and name in landmark_names(model.body)]
    angles = torch.as_tensor(ip.body.poses.pose_of(model.body, pose))[None]
    points = dict(zip(names, Landmarks(model, names)(angles)[0].double().numpy(), strict=True))
    found = np.zeros((33, 4))
    for row, name in enumerate(mediapipe.NAMES):
        if name in points:
            x, y, z = points[name] - (0.0, 0.2, 0.0)
            pixel = np.array([x, -y]) * FOCAL / (depth - z) + np.array(SIZE) / 2
            found[row] = *(pixel / SIZE), 0.0, 1.0
    return found


def write(path: Path, landmarks: np.ndarray, size: tuple[int, int] = SIZE) -> Path:
    """A file in MediaPipe's format."""
    content = {"format": "mediapipe-pose", "image_size": list(size), "landmarks": landmarks.tolist()}
    path.write_text(json.dumps(content))
    return path
