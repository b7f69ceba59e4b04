"""Annotations in the form of SPIN: one `.npz` with one row per person, in which many data sets are shared.

imgname (N,), center (N, 2) px and scale (N,) = side of the square box / 200, and any of the following:

    part (N, 24, 3)         x, y in pixels and 1 where labelled, of the joints JOINTS
    openpose (N, 25, 3)     x, y and confidence of OpenPose's BODY_25
    S (N, 24, 4)            x, y, z in metres and 1 where known, of JOINTS, in the camera's axes, from the pelvis
    pose (N, 72), shape (N, 10), has_smpl (N,), gender (N,)    SMPL in the camera's axes, without a place

and what IPMAN adds, in the axes of the data set's world:

    S_world (N, 24, 4), pose_world (N, 72), transl_world (N, 3), has_smpl_world (N,)
    cam_r (N, 3, 3), cam_k (N, 3, 3), cam_t (N, 3, 1) or (N, 1, 3)    each data set has a convention of its own
    ground_offset (N,)      height of the floor, m
    in_bos_label (N,)       1 stable, 0 unstable, -1 unstable and without contact
    contact_label (N,)      1 where the body touches the floor

Nothing is read at first but the names and shapes of the arrays (see `rows`).
"""

from __future__ import annotations

import os
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from ipman_rs.data.keypoints.openpose import BODY_25
from ipman_rs.ground import Ground

from . import naming
from .check import Finding, check_frames, raise_if_wrong, sample, stance
from .frames import Array, Cameras, Frames, Rows
from .rows import TEXT, RowFile

JOINTS = (
    "right_ankle", "right_knee", "right_hip", "left_hip", "left_knee", "left_ankle", "right_wrist", "right_elbow",
    "right_shoulder", "left_shoulder", "left_elbow", "left_wrist", "neck", "head_top", "pelvis", "thorax", "spine",
    "jaw", "head", "nose", "left_eye", "right_eye", "left_ear", "right_ear",
)  # fmt: skip
OPENPOSE = tuple(f"openpose_{name}" for name in BODY_25)
SHAPES: dict[str, tuple[int, ...] | str] = {
    "imgname": TEXT, "center": (2,), "scale": (), "part": (24, 3), "openpose": (25, 3), "S": (24, 4), "pose": (72,),
    "shape": (10,), "has_smpl": (), "gender": TEXT, "S_world": (24, 4), "pose_world": (72,), "transl_world": (3,),
    "has_smpl_world": (), "cam_r": (3, 3), "cam_t": (3,), "cam_k": (3, 3), "ground_offset": (), "in_bos_label": (),
    "contact_label": (),
}  # fmt: skip
REQUIRED = ("imgname", "center", "scale")
CAMERA = ("cam_r", "cam_t", "cam_k")
WORLD = ("S_world", "pose_world")  # either makes it a file with a world
GENDERS = {"m": "male", "f": "female", "n": "neutral", "male": "male", "female": "female", "neutral": "neutral"}


def image_by_itself(image: str) -> tuple[str, str]:
    """Name and sequence of a frame that belongs to no sequence."""
    return naming.stem(image), naming.stem(image)


@dataclass(frozen=True)
class Form:
    """What one data set has of its own: its files, names, axes, floor and camera convention."""

    name: str
    files: Mapping[str, str]  # split -> file; the first is opened where none is asked for
    label: Callable[[str], tuple[str, str]] = image_by_itself  # path of the image -> names of frame and sequence
    people: Callable[[NDArray[np.str_], NDArray[np.str_]], NDArray[np.int64]] | None = None  # several in an image
    up: tuple[float, float, float] | None = None  # of its world
    height: float | None = None  # m, of the floor along `up`, where the file has no ground_offset
    video_rate: float | None = None  # Hz
    camera_t: Callable[[Array, Array, NDArray[np.str_]], Array] | None = None  # cam_r, cam_t, imgname -> t (F, 3) m
    wanted: Mapping[str, str] = field(default_factory=dict)  # column -> what cannot be computed without it

    def open(
        self,
        path: str | os.PathLike[str],
        split: str | None = None,
        frame: Literal["world", "camera"] | None = None,
        height: float | None = None,
    ) -> Spin:
        """The data set in the file `path`, or in the file of `split` in the folder `path`.

        `frame`: bodies in the world's axes or in the camera's, where they have no place; None: the world's where the
        file has one. `height` of the floor in metres, where the data set's own is not to be taken. Raises ValueError
        naming the file for what is missing, damaged, of a wrong shape, or not metres, radians and the axes that are
        promised.
        """
        file = _file(self, Path(path), split)
        data = Spin(RowFile(file, SHAPES, REQUIRED), self, frame, height)
        raise_if_wrong(file, _check_rows(data))
        return data

    def check(self, path: str | os.PathLike[str]) -> list[Finding]:
        """What is there, what is missing and what is wrong in a file, or in a folder with the files of all splits."""
        place = Path(path)
        if place.is_file():
            return _check_file(self, place)
        if not place.is_dir():
            return [Finding("wrong", f"{place}: no such file or folder")]
        findings: list[Finding] = []
        for split, name in self.files.items():
            if (place / name).is_file():
                findings += _check_file(self, place / name)
            else:
                findings.append(Finding("missing", f"{name}: not in the folder", f"only the split {split!r} needs it"))
        return findings


class Spin:
    """A data set in this form: the rows of one file, as Frames."""

    def __init__(self, file: RowFile, form: Form, frame: str | None = None, height: float | None = None) -> None:
        self.file, self.form = file, form
        self.world = self._in_world(frame)
        self.height = form.height if height is None else height
        self.people = self._people()
        labels = [form.label(image) for image in self.file.texts("imgname", slice(0, 64)).tolist()]
        self.frame_rate = naming.frame_rate(labels, form.video_rate)
        if "ground_offset" in self.file and not np.isfinite(self.file.arrays["ground_offset"]).all():
            raise ValueError(f"{file.path}: ground_offset: expected metres in every row, got NaN or infinity")

    def __len__(self) -> int:
        return len(self.file)

    def __getitem__(self, rows: Rows) -> Frames:
        images = self.file.texts("imgname", rows)
        names, sequences = self._labels(images, rows)
        return Frames(
            names=names,
            sequences=sequences,
            ground=self._ground(len(images), rows),
            frame_rate=self.frame_rate,
            **self._body(rows),
            **self._joints(rows),
            images=images,
            cameras=self._cameras(images, rows),
            **self._keypoints(rows),
            boxes=self._boxes(rows),
            standing=self._label("in_bos_label", rows),
            contact=self._label("contact_label", rows),
        )

    def _in_world(self, frame: str | None) -> bool:
        if frame not in (None, "world", "camera"):
            raise ValueError(f"frame: expected 'world' or 'camera', got {frame!r}")
        there = any(name in self.file for name in WORLD)
        if frame == "world" and not there:
            raise ValueError(
                f"{self.file.path}: frame: 'world' needs {' or '.join(WORLD)}, which the file does not have"
            )
        return there and frame != "camera"

    def _labels(self, images: NDArray[np.str_], rows: Rows) -> tuple[NDArray[np.str_], NDArray[np.str_]]:
        names, sequences = zip(*map(self.form.label, images.tolist()), strict=True) if len(images) else ((), ())
        if self.people is None:
            return np.array(names, np.str_), np.array(sequences, np.str_)
        return naming.numbered(names, self.people[rows]), naming.numbered(sequences, self.people[rows])

    def _people(self) -> NDArray[np.int64] | None:
        """The number of each row's person, which takes all names of the file: of data sets of single images."""
        if self.form.people is None:
            return None
        images = self.file.texts("imgname", slice(None))
        sequences = np.array([self.form.label(image)[1] for image in images.tolist()], np.str_)
        return self.form.people(images, sequences)

    def _ground(self, count: int, rows: Rows) -> Ground | None:
        if not self.world or self.form.up is None:
            return None
        if "ground_offset" in self.file:
            return Ground(np.tile(self.form.up, (count, 1)), self.file.numbers("ground_offset", rows))
        return None if self.height is None else Ground(self.form.up, self.height)

    def _body(self, rows: Rows) -> dict[str, Any]:
        """SMPL's parameters; NaN where the file says that a row has none."""
        pose, fitted = ("pose_world", "has_smpl_world") if self.world else ("pose", "has_smpl")
        if pose not in self.file:
            return {}
        columns = {"pose": self.file.numbers(pose, rows).reshape(-1, 24, 3)}
        if "shape" in self.file:
            columns["betas"] = self.file.numbers("shape", rows)
        if self.world and "transl_world" in self.file:
            columns["transl"] = self.file.numbers("transl_world", rows)
        if fitted in self.file:
            lacking = self.file.numbers(fitted, rows) == 0
            columns = {
                name: np.where(lacking.reshape(-1, *[1] * (each.ndim - 1)), np.nan, each)
                for name, each in columns.items()
            }
        return {"body": "smpl", "genders": self._genders(rows), **columns}

    def _genders(self, rows: Rows) -> NDArray[np.str_]:
        """SPIN's own fits are SMPL's neutral model."""
        if "gender" not in self.file:
            return np.full(len(self.file.arrays["imgname"][rows]), "neutral")
        return genders(self.file, rows)

    def _joints(self, rows: Rows) -> dict[str, Any]:
        name = "S_world" if self.world else "S"
        if name not in self.file:
            return {}
        values = self.file.numbers(name, rows)
        return {"joints": np.where(values[..., 3:] > 0, values[..., :3], np.nan), "joint_names": JOINTS}

    def _keypoints(self, rows: Rows) -> dict[str, Any]:
        there = [(name, names) for name, names in (("part", JOINTS), ("openpose", OPENPOSE)) if name in self.file]
        if not there:
            return {}
        points = np.concatenate([self.file.numbers(name, rows) for name, _ in there], axis=1)
        return {"keypoints": points, "keypoint_names": tuple(each for _, names in there for each in names)}

    def _boxes(self, rows: Rows) -> Array:
        side = 200 * self.file.numbers("scale", rows)[:, None]
        return np.concatenate([self.file.numbers("center", rows) - side / 2, side, side], axis=1)

    def _cameras(self, images: NDArray[np.str_], rows: Rows) -> Cameras | None:
        if not self.world or self.form.camera_t is None or any(name not in self.file for name in CAMERA):
            return None
        rotation, translation, intrinsics = (self.file.numbers(name, rows) for name in CAMERA)
        return Cameras(rotation, self.form.camera_t(rotation, translation, images), intrinsics)

    def _label(self, name: str, rows: Rows) -> NDArray[np.bool_] | None:
        return self.file.numbers(name, rows) == 1 if name in self.file else None


def genders(file: RowFile, rows: Rows) -> NDArray[np.str_]:
    """The array `gender` in full words. ValueError for another word."""
    words = file.texts("gender", rows).tolist()
    unknown = set(words) - set(GENDERS)
    if unknown:
        raise ValueError(f"{file.path}: gender: expected one of {', '.join(GENDERS)}, got {unknown.pop()!r}")
    return np.array([GENDERS[gender] for gender in words], np.str_)


def _check_file(form: Form, file: Path) -> list[Finding]:
    try:
        data = Spin(RowFile(file, SHAPES, REQUIRED), form)
        findings = [Finding("ok", f"{len(data)} rows with {', '.join(data.file)}"), *_check_rows(data)]
        if data.world and "S" in data.file:
            in_camera = _check_rows(Spin(data.file, form, "camera"))
            findings += [Finding(each.level, f"in the camera's axes: {each.what}", each.advice) for each in in_camera]
        findings += data.file.scan()
    except ValueError as error:
        return [Finding("wrong", str(error))]
    lacking = [
        Finding("missing", f"{name}: no such array", why) for name, why in form.wanted.items() if name not in data.file
    ]
    return [Finding(each.level, f"{file.name}: {each.what}", each.advice) for each in [*findings, *lacking]]


def _check_rows(data: Spin) -> list[Finding]:
    """Axes are judged where there is no floor, too. Cameras are held upright: up is -y in their axes."""
    frames = sample(data)
    up = data.form.up if data.world else (0.0, -1.0, 0.0)
    return check_frames(frames) + (stance(frames, Ground(up)) if frames.ground is None and up is not None else [])


def _file(form: Form, path: Path, split: str | None) -> Path:
    if split is not None and split not in form.files:
        raise ValueError(f"split: {form.name} has {', '.join(form.files)}, got {split!r}")
    if path.is_file():
        return path
    names = [form.files[split]] if split is not None else list(form.files.values())
    existing = [path / name for name in names if (path / name).is_file()]
    if not existing:
        what = f"none of {', '.join(names)} in it" if path.is_dir() else "no such file or folder"
        raise ValueError(f"{path}: {what}; `ipman data check {form.name} {path}` tells what is expected")
    return existing[0]


def millimetres_or_metres(translation: Array) -> Array:
    """Millimetres, as Human3.6M's and MPI-INF-3DHP's calibrations have them, into metres; cameras stand within 20 m."""
    distance = np.linalg.norm(translation, axis=-1)
    far = np.isfinite(distance).any() and np.median(distance[np.isfinite(distance)]) > 20
    return translation / 1000 if far else translation
