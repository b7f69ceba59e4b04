"""Miniature RICH: bodies in camera 0's axes, cameras, and the ground and the way to it in the laser scan's world.

Everything is worked out in the scan's world (z up) and taken into camera 0's axes at the end.
"""

from __future__ import annotations

import json
import pickle

import numpy as np
import trimesh
from scipy.spatial.transform import Rotation

YOGA = ("Pavallion_000_yoga1", "Pavallion_000_yoga2", "Pavallion_006_yoga1", "Pavallion_018_yoga1")
TEST = ("Pavallion_002_yoga1", "Pavallion_013_yoga2", "ParkingLot2_014_pushup2", "ParkingLot1_005_pushup1")
SCALE = 1.002  # c, of the way from the cameras' metres to the scan's
FLOOR = -0.35  # m, the ground's height in the scan's world
SLOPE = np.radians(1.5)  # of the ground


def to_world(scene):
    """R (3, 3), t (3,), c of world = c · X R + t for rows X in camera 0's axes: a camera that looks down a little."""
    forward = np.array([np.cos(len(scene)), np.sin(len(scene)), -0.3])
    forward /= np.linalg.norm(forward)
    right = np.cross(forward, [0, 0, 1])
    right /= np.linalg.norm(right)
    axes = np.stack([right, np.cross(forward, right), forward])  # camera's axes in the world, as rows
    return axes, np.array([0.5, -1.0, 1.6]), SCALE


def into_camera(points, scene):
    rotation, translation, scale = to_world(scene)
    return (np.asarray(points) - translation) @ rotation.T / scale


def ground_points():
    """Points on the ground in the world, and its normal."""
    x, y = np.meshgrid(np.linspace(-3, 3, 7), np.linspace(-3, 3, 7))
    z = FLOOR + np.tan(SLOPE) * x
    normal = np.array([-np.sin(SLOPE), 0, np.cos(SLOPE)])
    return np.stack([x, y, z], axis=-1).reshape(-1, 3), normal


def ground(path, turn=None, scale=1.0):
    points, _ = ground_points()
    points = points if turn is None else points @ np.asarray(turn).T
    corners = np.arange(49).reshape(7, 7)
    quads = [
        (corners[i, j], corners[i, j + 1], corners[i + 1, j + 1], corners[i + 1, j]) for i in range(6) for j in range(6)
    ]
    faces = [face for a, b, c, d in quads for face in ((a, b, c), (a, c, d))]
    path.parent.mkdir(parents=True, exist_ok=True)
    trimesh.Trimesh(points * scale, faces, process=False).export(path)


def camera(number):
    """Rotation, translation (3,) m and intrinsics of a camera: camera 0 is where the world of the bodies is."""
    rotation = Rotation.from_rotvec([0, 0.4 * number, 0]).as_matrix()
    translation = np.array([-0.5 * number, 0.02 * number, 0.3 * number])
    return rotation, translation, np.array([[2400.0 + number, 0, 1536], [0, 2400.0 + number, 1028], [0, 0, 1]])


def calibration(path, number, scale=1.0, doctype="", cut=None):
    """A camera's file, as OpenCV's storage writes matrices."""
    rotation, translation, intrinsics = camera(number)
    matrices = {
        "CameraMatrix": np.concatenate([rotation, scale * translation[:, None]], axis=1),
        "Intrinsics": intrinsics,
        "Distortion": np.array([[0.01, -0.02, 0, 0, 0]]),
    }
    parts = [
        f'<{name} type_id="opencv-matrix">\n  <rows>{len(values)}</rows>\n  <cols>{values.shape[1]}</cols>\n'
        f"  <dt>d</dt>\n  <data>\n    {' '.join(repr(float(x)) for x in values.ravel())}</data></{name}>"
        for name, values in matrices.items()
    ]
    path.parent.mkdir(parents=True, exist_ok=True)
    text = f'<?xml version="1.0"?>\n{doctype}<opencv_storage>\n' + "\n".join(parts) + "\n</opencv_storage>\n"
    path.write_text(text[:cut])


def body(path, scene, frame=0, seed=0, up=(0, 0, 1), scale=1.0, **changes):
    """A frame's SMPL-X arguments: somebody who stands on the ground and turns. Gives them as written."""
    rng = np.random.default_rng([seed, frame])
    rotation, *_ = to_world(scene)
    upright = Rotation.align_vectors([up], [[0, 1, 0]])[0]
    turned = Rotation.from_rotvec(np.array(up) * 0.3 * frame) * upright
    root = Rotation.from_matrix(rotation) * turned  # rows of R are the camera's axes: R takes world vectors into it
    place = np.array([3.0 * np.cos(len(scene)), 3.0 * np.sin(len(scene)), FLOOR + 1.3])
    content = {
        "transl": into_camera(place, scene)[None] * scale,
        "global_orient": root.as_rotvec()[None],
        "body_pose": rng.normal(scale=0.1, size=(1, 63)),
        "betas": np.random.default_rng(seed).normal(size=(1, 10)),
        "left_hand_pose": rng.normal(size=(1, 12)),
        "right_hand_pose": rng.normal(size=(1, 12)),
        "jaw_pose": rng.normal(scale=0.1, size=(1, 3)),
        "leye_pose": np.zeros((1, 3)),
        "reye_pose": np.zeros((1, 3)),
        "expression": np.zeros((1, 10)),
    }
    content = {name: value.astype(np.float32) for name, value in content.items()} | changes
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_bytes(pickle.dumps({name: value for name, value in content.items() if value is not None}))
    return content


def scene(root, name, cameras=3):
    rotation, translation, scale = to_world(name)
    for number in range(cameras):
        calibration(root / "scan_calibration" / name / "calibration" / f"{number:03d}.xml", number)
    ground(root / "scan_calibration" / name / "ground_mesh.ply")
    path = root / "multicam2world" / f"{name}_multicam2world.json"
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(json.dumps({"R": rotation.tolist(), "t": translation.tolist(), "c": scale}))


def sequence(root, name, split="train", frames=(5, 6, 7), people=None, **options):
    """Bodies and images of a sequence; gives what was written by person and frame."""
    scene_name, subject = name.split("_")[:2]
    truth = {}
    for number, person in enumerate(people or [subject]):
        for frame in frames:
            path = root / "bodies" / split / name / f"{frame:05d}" / f"{person}.pkl"
            truth[person, frame] = body(path, scene_name, frame, seed=number, **options)
    for frame in frames:
        image = root / "images" / split / name / "cam_00" / f"{frame:05d}_00.jpeg"
        image.parent.mkdir(parents=True, exist_ok=True)
        image.write_bytes(b"")
    return truth


def write(root):
    """All of IPMAN's sequences, in the splits of the data set; gives the truth by sequence."""
    truth = {}
    for name in (*YOGA, *TEST):
        split = "train" if name in ("Pavallion_000_yoga2", "Pavallion_013_yoga2") else "val"
        truth[name] = sequence(root, name, split)
    for name in ("Pavallion", "ParkingLot1", "ParkingLot2"):
        scene(root, name)
    return truth
