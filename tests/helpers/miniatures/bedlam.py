"""Miniature BEDLAM scene: y down, an origin a person, cam_ext of the world to the camera, SMPL-X joints projected."""

from __future__ import annotations

import numpy as np

from . import spin, stick

UP = (0.0, -1.0, 0.0)
NAMED = ("pelvis", "left_hip", "right_hip", "spine1", "left_knee", "right_knee", "spine2", "left_ankle", "right_ankle")


def write(folder, name="20221010_3_1000_batch01hand_6fps.npz", frames=4, people=2, columns=165, **changes):
    """A sequence of two people, seen by one camera whose place differs from person to person."""
    file, truth = {}, {"joints": [], "pixels": [], "names": []}
    focal, centre = 1200.0, (640.0, 360.0)
    for person in range(people):
        for frame in range(frames):
            feet = [0.1 * frame, 0.0, 0.0]
            rotation, t = stick.camera([0.5 - person, -1.4, -6.0], [0.0, -0.9, 0.0], UP)
            joints = [stick.joint(each, feet, UP, 0.3 * frame) for each in NAMED]
            pixels = [stick.pixel(joint, rotation, t, focal, centre) for joint in joints]
            points = np.full((127, 3), 1.0)
            points[:, :2] = np.mean(pixels, axis=0)
            points[: len(NAMED), :2] = pixels
            centre_of_box, scale = stick.box(pixels)
            pose = np.zeros(columns)
            pose[:3] = stick.root(UP, 0.3 * frame)
            ext = np.eye(4)
            ext[:3, :3], ext[:3, 3] = rotation, t
            row = {"imgname": f"seq_000000/seq_000000_{5 * frame:04d}.png", "center": centre_of_box, "scale": scale,
                   "pose_world": pose, "pose_cam": pose, "trans_world": [feet[0], -1.2, 0.0], "trans_cam": np.zeros(3),
                   "shape": np.full(11, 0.1), "cam_int": [[focal, 0, centre[0]], [0, focal, centre[1]], [0, 0, 1]],
                   "cam_ext": ext, "gtkps": points, "gender": "female", "sub": f"rp_person_{person}"}  # fmt: skip
            for each, value in row.items():
                file.setdefault(each, []).append(value)
            truth["joints"].append(joints)
            truth["pixels"].append(pixels)
            truth["names"].append(f"{name[:-4]}/seq_000000_{5 * frame:04d}" + (f"#{person}" if person else ""))
    arrays = {each: np.array(value) for each, value in file.items()}
    arrays["motion_info"] = np.array([{"label": "walk"}] * len(truth["names"]), dtype=object)  # never read
    return spin.save(folder / name, arrays, changes), truth
