"""Miniature 3DPW: sequence files as Python 2 pickled them, from the data set's own readme, and SPIN's `.npz`."""

from __future__ import annotations

import io
import pickle
import struct

import numpy as np

from . import spin, stick

COCO_18 = [
    "nose", "neck", "right_shoulder", "right_elbow", "right_wrist", "left_shoulder", "left_elbow", "left_wrist",
    "right_hip", "right_knee", "right_ankle", "left_hip", "left_knee", "left_ankle", "right_eye", "left_eye",
    "right_ear", "left_ear",
]  # fmt: skip
SMPL_24 = [
    "pelvis", "left_hip", "right_hip", "spine1", "left_knee", "right_knee", "spine2", "left_ankle", "right_ankle",
    "spine3", "left_foot", "right_foot", "neck", "left_collar", "right_collar", "head", "left_shoulder",
    "right_shoulder", "left_elbow", "right_elbow", "left_wrist", "right_wrist", "left_hand", "right_hand",
]  # fmt: skip
UP = (0.0, 1.0, 0.0)


class Python2Pickler(pickle._Pickler):
    """Text and bytes are both Python 2's `str`."""

    dispatch = pickle._Pickler.dispatch.copy()

    def save_old_text(self, text):
        data = text.encode("latin1") if isinstance(text, str) else text
        head = b"U" + bytes([len(data)]) if len(data) < 256 else b"T" + struct.pack("<i", len(data))
        self.write(head + data)
        self.memoize(text)

    dispatch[str] = dispatch[bytes] = save_old_text


def pickled(content):
    """As Python 2 and the numpy of its time wrote it, protocol 2."""
    stream = io.BytesIO()
    Python2Pickler(stream, 2).dump(content)
    return stream.getvalue().replace(b"cnumpy._core.multiarray\n", b"cnumpy.core.multiarray\n")


def content(sequence="downtown_arguing_00", frames=5, people=2, invalid=((0, 2),)):
    """The dictionary of a sequence, people of sticks before a camera that walks; and the truth behind it."""
    focal, centre = 1961.0, (540.0, 960.0)
    cameras, shared = [], []
    for frame in range(frames):
        rotation, t = stick.camera([0.3 * frame, 1.6, 6.0], [0.0, 0.9, 0.0], UP)
        shared.append((rotation, t))
        cameras.append([[*rotation[i], t[i]] for i in range(3)] + [[0.0, 0.0, 0.0, 1.0]])
    persons = []
    for person in range(people):
        positions, points = [], []
        for frame, (rotation, t) in enumerate(shared):
            feet = [1.5 * person - 0.5, 0.0, 0.1 * frame]
            positions.append([x for name in SMPL_24 for x in stick.joint(name, feet, UP, 0.2 * frame)])
            seen = [
                stick.pixel(stick.joint(name, feet, UP, 0.2 * frame), rotation, t, focal, centre) for name in COCO_18
            ]
            points.append([[p[0] for p in seen], [p[1] for p in seen], [0.9] * 18])
        pose = np.zeros((frames, 72))
        pose[:, :3] = [stick.root(UP, 0.2 * frame) for frame in range(frames)]
        persons.append((pose, np.array(positions), np.array(points)))
    valid = [
        np.array([(person, frame) not in invalid for frame in range(frames)], np.int64) for person in range(people)
    ]
    return {
        "sequence": sequence,
        "betas": [np.linspace(-1, 1, 10) for _ in range(people)],
        "poses": [person[0] for person in persons],
        "trans": [person[1][:, :3] + 0.2 for person in persons],
        "poses_60Hz": [np.repeat(person[0], 2, axis=0) for person in persons],
        "trans_60Hz": [np.repeat(person[1][:, :3], 2, axis=0) for person in persons],
        "betas_clothed": [np.zeros(10) for _ in range(people)],
        "v_template_clothed": [np.zeros((6890, 3), np.float32) for _ in range(people)],
        "texture_maps": [],
        "genders": ["m", "f"][:people],
        "jointPositions": [person[1] for person in persons],
        "poses2d": [person[2] for person in persons],
        "img_frame_ids": np.arange(0, 2 * frames, 2),
        "cam_poses": np.array(cameras),
        "campose_valid": valid,
        "cam_intrinsics": np.array([[focal, 0.0, centre[0]], [0.0, focal, centre[1]], [0.0, 0.0, 1.0]]),
    }


def write(folder, split="test", sequence="downtown_arguing_00", change=None, **options):
    """`sequenceFiles/SPLIT/SEQUENCE.pkl` under the folder; `change(content)` may spoil it."""
    made = content(sequence, **options)
    if change is not None:
        change(made)
    file = folder / "sequenceFiles" / split / f"{sequence}.pkl"
    file.parent.mkdir(parents=True, exist_ok=True)
    file.write_bytes(pickled(made))
    return file, made


def write_npz(folder, count=8, **changes):
    """`3dpw_test.npz`: the first person's images, then the second's."""
    arrays, truth = spin.rows(count, range(24))
    half = count // 2
    images = [f"imageFiles/downtown_arguing_00/image_{row % half:05d}.jpg" for row in range(count)]
    arrays = {"center": arrays["center"], "scale": arrays["scale"], "imgname": np.array(images)}
    arrays["pose"] = np.zeros((count, 72))
    arrays["pose"][:, 0] = np.pi
    arrays["shape"] = np.zeros((count, 10))
    arrays["gender"] = np.array(["m" if row < half else "f" for row in range(count)])
    return spin.save(folder / "3dpw_test.npz", arrays, changes), truth
