"""3D Poses in the Wild: one or two people outdoors with inertial sensors and a moving camera, 30 Hz.

    sequenceFiles/train/*.pkl, sequenceFiles/validation/*.pkl, sequenceFiles/test/*.pkl    the data set's own files
    3dpw_test.npz                                                                          SPIN's form (see `spin`)

A `.pkl` has for each person poses (F, 72), trans (F, 3) m, betas (10,), genders, jointPositions (F, 72) m,
poses2d (F, 3, 18) in pixels with a confidence, campose_valid (F,); and for all cam_poses (F, 4, 4), cam_intrinsics
(3, 3) and the sequence's name. Nothing in it is executed. All files of a split are read when it is opened, and 4 kB a
frame are kept.

World: metres, that of the sensors; neither its up nor a floor is in the files, so there is no ground.
Camera: X_c = cam_pose X_w. Frames whose camera was not aligned with the image (campose_valid is 0) are left out, as all
protocols do. The frames of a person follow each other; names are `downtown_arguing_00/image_00012`, with `#1` for the
second person. In SPIN's file bodies are in the camera's axes and have no place.

Where it comes from: the data set's own site for `.pkl` and images, the repository of SPIN for the `.npz`.
"""

from __future__ import annotations

import os
import re
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from ipman_rs.body import joints
from ipman_rs.files import safe_pickle

from . import naming, spin
from .check import Finding, check_frames, require_plausible
from .frames import Array, Cameras, Frames
from .joined import concatenate

NAME = "3dpw"
SPLITS = ("test", "validation", "train")
FILES = {"test": 24, "validation": 12, "train": 24}
RATE = 30.0
COCO_18 = (
    "nose", "neck", "right_shoulder", "right_elbow", "right_wrist", "left_shoulder", "left_elbow", "left_wrist",
    "right_hip", "right_knee", "right_ankle", "left_hip", "left_knee", "left_ankle", "right_eye", "left_eye",
    "right_ear", "left_ear",
)  # fmt: skip
PEOPLE = ("poses", "trans", "betas", "genders", "jointPositions", "poses2d", "campose_valid")
SHARED = ("cam_poses", "cam_intrinsics", "sequence")
IMAGE = re.compile(r"(?:imageFiles/)?([^/]+)/(image_\d+)\.\w+$")


def label(image: str) -> tuple[str, str]:
    """`downtown_arguing_00/image_00012` and `downtown_arguing_00`."""
    match = IMAGE.search(image)
    return (f"{match[1]}/{match[2]}", match[1]) if match else spin.image_by_itself(image)


FORM = spin.Form(
    NAME,
    {"test": "3dpw_test.npz"},
    label=label,
    people=naming.person,
    video_rate=RATE,
    wanted={"pose": "no body", "shape": "no body", "gender": "bodies are measured with the models of their genders"},
)


def open(path: str | os.PathLike[str], split: str | None = None) -> Frames | spin.Spin:
    """Frames of a `.pkl` or `.npz` file, or of the split's `.pkl` files in the folder; None: "test".

    Raises ValueError naming the file for what is missing, damaged or hostile, of a wrong shape, or not metres and
    radians.
    """
    place = Path(path)
    if place.is_file() and place.suffix == ".npz":
        return FORM.open(place)
    files = [place] if place.is_file() else _sequence_files(place, split or "test")
    if not files and (place / FORM.files["test"]).is_file():
        return FORM.open(place, split)
    if not files:
        raise ValueError(f"{place}: no sequenceFiles/{split or 'test'}/*.pkl and no 3dpw_test.npz in it")
    return require_plausible(place, concatenate([person for file in files for person in _people(file)]))


def check(path: str | os.PathLike[str]) -> list[Finding]:
    """What is there, missing and wrong."""
    place = Path(path)
    if place.suffix == ".npz":
        return FORM.check(place)
    if place.is_file():
        return _check_files([place])
    if not place.is_dir():
        return [Finding("wrong", f"{place}: no such file or folder")]
    if not (place / "sequenceFiles").is_dir() and (place / FORM.files["test"]).is_file():
        return FORM.check(place)
    findings: list[Finding] = []
    for split, expected in FILES.items():
        files = _sequence_files(place, split)
        findings += _check_files(files)
        if len(files) != expected:
            message = f"sequenceFiles/{split}: {len(files)} of {expected} sequences"
            findings.append(Finding("missing", message, "unpack sequenceFiles.zip into the folder"))
    return findings


def _check_files(files: list[Path]) -> list[Finding]:
    findings: list[Finding] = []
    for file in files:
        try:
            frames = concatenate(_people(file))
        except ValueError as error:
            findings.append(Finding("wrong", str(error)))
            continue
        own = [Finding("ok", f"{len(frames)} frames of {len(set(frames.sequences))} people")]
        own += check_frames(frames)
        findings += [Finding(each.level, f"{file.name}: {each.what}", each.advice) for each in own]
    return findings


def _sequence_files(folder: Path, split: str) -> list[Path]:
    if split not in SPLITS:
        raise ValueError(f"split: expected one of {', '.join(SPLITS)}, got {split!r}")
    return sorted((folder / "sequenceFiles" / split).glob("*.pkl"))


def _people(file: Path) -> list[Frames]:
    """The people of a sequence file, where the camera is known. ValueError for anything unexpected in it."""
    content = safe_pickle.read(file, "sequence of 3DPW", "a file of its sequenceFiles")
    lacking = [name for name in (*PEOPLE, *SHARED) if name not in content]
    if lacking:
        raise ValueError(f"{file}: no {', '.join(lacking)} in it; is it a sequence file of 3DPW?")
    count = len(content["poses"]) if isinstance(content["poses"], list) else 0
    for name in PEOPLE:
        if not isinstance(content[name], list) or len(content[name]) != count or not count:
            raise ValueError(f"{file}: {name}: expected a list with an entry a person, as many as in poses ({count})")
    cameras = _array(file, "cam_poses", content["cam_poses"], (-1, 4, 4))
    return [_person(file, content, number, cameras) for number in range(count)]


def _person(file: Path, content: Mapping[str, Any], number: int, cameras: Array) -> Frames:
    def array(name: str, shape: tuple[int, ...]) -> Array:
        return _array(file, f"{name}[{number}]", content[name][number], shape)

    count = len(cameras)
    rows = np.flatnonzero(array("campose_valid", (count,)))
    betas = array("betas", (-1,))[:10]
    gender = content["genders"][number]
    if gender not in ("m", "f"):
        raise ValueError(f"{file}: genders[{number}]: expected 'm' or 'f', got {gender!r}")
    sequence = str(content["sequence"])
    names = np.array([f"{sequence}/image_{frame:05d}" for frame in rows], np.str_)
    sequences = np.full(len(rows), sequence)
    people = np.full(len(rows), number)
    views = cameras[rows]
    intrinsics = _array(file, "cam_intrinsics", content["cam_intrinsics"], (3, 3))
    return Frames(
        names=naming.numbered(names, people),
        sequences=naming.numbered(sequences, people),
        frame_rate=RATE,
        body="smpl",
        genders=np.full(len(rows), spin.GENDERS[gender]),
        pose=array("poses", (count, 72))[rows].reshape(-1, 24, 3),
        betas=np.tile(betas, (len(rows), 1)),
        transl=array("trans", (count, 3))[rows],
        joints=array("jointPositions", (count, 72))[rows].reshape(-1, 24, 3),
        joint_names=joints.SMPL,
        images=np.array([f"imageFiles/{name}.jpg" for name in names.tolist()], np.str_),
        cameras=Cameras(views[:, :3, :3], views[:, :3, 3], np.tile(intrinsics, (len(rows), 1, 1))),
        keypoints=array("poses2d", (count, 3, 18))[rows].swapaxes(1, 2),
        keypoint_names=COCO_18,
    )


def _array(file: Path, name: str, value: Any, shape: tuple[int, ...]) -> Array:
    """The numbers behind a value of the pickle, in that shape (-1: any size)."""
    try:
        array = safe_pickle.as_array(value)
    except ValueError as error:
        raise ValueError(f"{file}: {name}: {error}") from error
    array = array.reshape(-1) if len(shape) == 1 else array
    fits = array.ndim == len(shape) and all(want in (-1, got) for want, got in zip(shape, array.shape, strict=True))
    if not fits or array.dtype.kind not in "fiub":
        wanted = ", ".join("any" if size == -1 else str(size) for size in shape)
        raise ValueError(f"{file}: {name}: expected numbers of shape ({wanted}), got {array.dtype} of {array.shape}")
    return array.astype(np.float64)
