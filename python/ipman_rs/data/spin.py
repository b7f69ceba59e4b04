"""Annotations in the form of SPIN: one `.npz` with a row a person, which many data sets of people are shared in.

imgname (N,), center (N, 2) px and scale (N,) = side of the square box / 200, and of the others those that there are:

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

Nothing is read at first but the names and shapes of the arrays: numpy.savez stores them as they are, so they are mapped
into memory and a row costs what its own bytes cost, in a file of any length. A file of numpy.savez_compressed has to be
unpacked, which is done once for each array, and up to 1 GB each.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from ipman_rs.body import safe_npz
from ipman_rs.fitting.keypoints.openpose import BODY_25
from ipman_rs.ground import Ground

from . import naming
from .check import Finding, demanded, of_frames, sample
from .frames import Array, Cameras, Frames, Rows

JOINTS = (
    "right_ankle", "right_knee", "right_hip", "left_hip", "left_knee", "left_ankle", "right_wrist", "right_elbow",
    "right_shoulder", "left_shoulder", "left_elbow", "left_wrist", "neck", "head_top", "pelvis", "thorax", "spine",
    "jaw", "head", "nose", "left_eye", "right_eye", "left_ear", "right_ear",
)  # fmt: skip
OPENPOSE = tuple(f"openpose_{name}" for name in BODY_25)
COLUMNS: dict[str, tuple[int, ...]] = {  # of a row; dimensions of length one may be there or not
    "imgname": (), "center": (2,), "scale": (), "part": (24, 3), "openpose": (25, 3), "S": (24, 4), "pose": (72,),
    "shape": (10,), "has_smpl": (), "gender": (), "S_world": (24, 4), "pose_world": (72,), "transl_world": (3,),
    "has_smpl_world": (), "cam_r": (3, 3), "cam_t": (3,), "cam_k": (3, 3), "ground_offset": (), "in_bos_label": (),
    "contact_label": (),
}  # fmt: skip
REQUIRED = ("imgname", "center", "scale")
TEXTS = ("imgname", "gender")
WORLD = ("S_world", "pose_world")  # either makes it a file with a world
GENDERS = {"m": "male", "f": "female", "n": "neutral", "male": "male", "female": "female", "neutral": "neutral"}
PIECE = 1 << 16  # rows that a scan holds in memory


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


class Spin:
    """A data set in this form: rows of one file, as Frames."""

    def __init__(self, path: Path, form: Form, frame: str | None, height: float | None) -> None:
        self.path, self.form = path, form
        self.columns = _columns(path)
        self.world = _world_asked(path, self.columns, frame)
        self.height = form.height if height is None else height
        self.people = self._people()
        self.frame_rate = self._frame_rate()
        _finite_ground(path, self.columns)

    def __len__(self) -> int:
        return len(self.columns["imgname"])

    def __getitem__(self, rows: Rows) -> Frames:
        images = self._images(rows)
        names, sequences = self._labels(images, rows)
        has_body = "pose_world" in self.columns if self.world else "pose" in self.columns
        return Frames(
            names=names,
            sequences=sequences,
            ground=self._ground(len(images), rows),
            frame_rate=self.frame_rate,
            body="smpl" if has_body else None,
            genders=self._genders(rows) if has_body else None,
            **(self._body(rows) if has_body else {}),
            **self._joints(rows),
            images=images,
            cameras=self._cameras(images, rows) if self.world else None,
            **self._keypoints(rows),
            boxes=self._boxes(rows),
            standing=self._label("in_bos_label", rows),
            contact=self._label("contact_label", rows),
        )

    def scan(self) -> Iterator[Finding]:
        """Every number of the file, whether it is one."""
        for name, column in self.columns.items():
            if name in TEXTS:
                continue
            starts = range(0, len(column), PIECE)
            bad = sum(int((~_finite_rows(column[start : start + PIECE])).sum()) for start in starts)
            if bad:
                advice = "no figure is computed for them"
                yield Finding("missing", f"{name}: NaN or infinity in {bad} of {len(column)} rows", advice)

    def _rows(self, name: str, rows: Rows) -> NDArray[Any]:
        values = np.asarray(self.columns[name][rows])
        return values.reshape(len(values), *COLUMNS[name])

    def _numbers(self, name: str, rows: Rows) -> Array:
        return self._rows(name, rows).astype(np.float64)

    def _images(self, rows: Rows) -> NDArray[np.str_]:
        try:
            return self._rows("imgname", rows).astype(np.str_)
        except ValueError as error:
            raise ValueError(f"{self.path}: imgname: holds what is no text ({error})") from None

    def _labels(self, images: NDArray[np.str_], rows: Rows) -> tuple[NDArray[np.str_], NDArray[np.str_]]:
        pairs = [self.form.label(str(image)) for image in images]
        names = np.array([name for name, _ in pairs], np.str_)
        sequences = np.array([sequence for _, sequence in pairs], np.str_)
        if self.people is None:
            return names, sequences
        return naming.numbered(names, self.people[rows]), naming.numbered(sequences, self.people[rows])

    def _people(self) -> NDArray[np.int64] | None:
        if self.form.people is None:
            return None
        images = self._images(slice(None))
        sequences = np.array([self.form.label(str(image))[1] for image in images], np.str_)
        return self.form.people(images, sequences)

    def _frame_rate(self) -> float | None:
        names, sequences = zip(*map(self.form.label, map(str, self._images(slice(0, 64)))), strict=True) or ((), ())
        return naming.frame_rate(names, sequences, self.form.video_rate)

    def _ground(self, count: int, rows: Rows) -> Ground | None:
        if not self.world or self.form.up is None:
            return None
        if "ground_offset" in self.columns:
            return Ground(np.tile(self.form.up, (count, 1)), self._numbers("ground_offset", rows))
        return None if self.height is None else Ground(self.form.up, self.height)

    def _genders(self, rows: Rows) -> NDArray[np.str_]:
        if "gender" not in self.columns:
            return np.full(len(self.columns["imgname"][rows]), "neutral")
        given = self._rows("gender", rows).astype(np.str_)
        unknown = set(given.tolist()) - set(GENDERS)
        if unknown:
            raise ValueError(f"{self.path}: gender: expected one of {', '.join(GENDERS)}, got {unknown.pop()!r}")
        return np.array([GENDERS[gender] for gender in given.tolist()], np.str_)

    def _body(self, rows: Rows) -> dict[str, Array | None]:
        pose, transl, known = (
            ("pose_world", "transl_world", "has_smpl_world") if self.world else ("pose", "", "has_smpl")
        )
        found: dict[str, Array | None] = {
            "pose": self._numbers(pose, rows).reshape(-1, 24, 3),
            "betas": self._numbers("shape", rows) if "shape" in self.columns else None,
            "transl": self._numbers(transl, rows) if transl in self.columns else None,
        }
        if known in self.columns:
            unknown = self._rows(known, rows) == 0
            for values in found.values():
                if values is not None:
                    values[unknown] = np.nan
        return found

    def _joints(self, rows: Rows) -> dict[str, Any]:
        name = "S_world" if self.world else "S"
        if name not in self.columns:
            return {}
        values = self._numbers(name, rows)
        return {"joints": np.where(values[..., 3:] > 0, values[..., :3], np.nan), "joint_names": JOINTS}

    def _keypoints(self, rows: Rows) -> dict[str, Any]:
        there = [(name, names) for name, names in (("part", JOINTS), ("openpose", OPENPOSE)) if name in self.columns]
        if not there:
            return {}
        points = np.concatenate([self._numbers(name, rows) for name, _ in there], axis=1)
        return {"keypoints": points, "keypoint_names": tuple(each for _, names in there for each in names)}

    def _boxes(self, rows: Rows) -> Array:
        side = 200 * self._numbers("scale", rows)[:, None]
        return np.concatenate([self._numbers("center", rows) - side / 2, side, side], axis=1)

    def _cameras(self, images: NDArray[np.str_], rows: Rows) -> Cameras | None:
        if self.form.camera_t is None or not {"cam_r", "cam_t", "cam_k"} <= set(self.columns):
            return None
        rotation = self._numbers("cam_r", rows)
        translation = self.form.camera_t(rotation, self._numbers("cam_t", rows), images)
        return Cameras(rotation, translation, self._numbers("cam_k", rows))

    def _label(self, name: str, rows: Rows) -> NDArray[np.bool_] | None:
        return self._rows(name, rows) == 1 if name in self.columns else None


def open(
    form: Form,
    path: str | os.PathLike[str],
    split: str | None = None,
    frame: Literal["world", "camera"] | None = None,
    height: float | None = None,
) -> Spin:
    """The data set in the file `path`, or in the file of `split` in the folder `path`.

    `frame`: bodies in the world's axes or in the camera's, where they have no place; None: the world's where the file
    has one. `height` of the floor in metres, where the data set's own is not to be taken. Raises ValueError naming the
    file for what is missing, damaged, of a wrong shape, or not metres, radians and the axes that are promised.
    """
    file = _file(form, Path(path), split)
    return demanded(file, Spin(file, form, frame, height))


def check(form: Form, path: str | os.PathLike[str]) -> list[Finding]:
    """What is there, what is missing and what is wrong in a file, or in a folder with the files of all splits."""
    place = Path(path)
    if place.is_file():
        return _check_file(form, place)
    if not place.is_dir():
        return [Finding("wrong", f"{place}: no such file or folder")]
    found: list[Finding] = []
    for split, name in form.files.items():
        if (place / name).is_file():
            found += _check_file(form, place / name)
        else:
            found.append(
                Finding("missing", f"{name}: not in the folder (split {split!r})", "see the data set's own page")
            )
    return found


def _check_file(form: Form, file: Path) -> list[Finding]:
    try:
        data = Spin(file, form, None, None)
        found = [Finding("ok", f"{len(data)} rows with {', '.join(data.columns)}")]
        found += of_frames(sample(data))
        found += data.scan()
    except ValueError as error:
        return [Finding("wrong", str(error))]
    lacking = [
        Finding("missing", f"{name}: no such array", why)
        for name, why in form.wanted.items()
        if name not in data.columns
    ]
    return [Finding(each.level, f"{file.name}: {each.what}", each.advice) for each in [*found, *lacking]]


def _file(form: Form, path: Path, split: str | None) -> Path:
    if split is not None and split not in form.files:
        raise ValueError(f"split: {form.name} has {', '.join(form.files)}, got {split!r}")
    if path.is_file():
        return path
    names = [form.files[split]] if split is not None else list(form.files.values())
    found = [path / name for name in names if (path / name).is_file()]
    if not found:
        what = f"none of {', '.join(names)} in it" if path.is_dir() else "no such file or folder"
        raise ValueError(f"{path}: {what}; `ipman data check {form.name} {path}` tells what is expected")
    return found[0]


def _columns(path: Path) -> dict[str, NDArray[Any]]:
    """The arrays of the form that the file has, checked for type, rows and shape, but not read."""
    there = safe_npz.names(path)
    lacking = [name for name in REQUIRED if name not in there]
    if lacking:
        raise ValueError(f"{path}: no {', '.join(lacking)} among its arrays ({', '.join(sorted(there)) or 'none'})")
    columns = {name: safe_npz.mapped(path, name) for name in COLUMNS if name in there}
    rows = len(columns["imgname"]) if columns["imgname"].ndim else 0
    for name, column in columns.items():
        shape = tuple(size for size in column.shape[1:] if size != 1)
        if column.ndim == 0 or shape != COLUMNS[name]:
            raise ValueError(f"{path}: {name}: expected shape {(rows, *COLUMNS[name])}, got {column.shape}")
        if len(column) != rows:
            raise ValueError(f"{path}: {name}: expected {rows} rows, as imgname has, got {len(column)}")
        if column.dtype.kind not in ("US" if name in TEXTS else "fiub"):
            kind = "text" if name in TEXTS else "numbers"
            raise ValueError(f"{path}: {name}: expected {kind}, got type {column.dtype}")
    if not rows:
        raise ValueError(f"{path}: no rows: every array is empty")
    return columns


def _world_asked(path: Path, columns: Mapping[str, Any], frame: str | None) -> bool:
    if frame not in (None, "world", "camera"):
        raise ValueError(f"frame: expected 'world' or 'camera', got {frame!r}")
    there = any(name in columns for name in WORLD)
    if frame == "world" and not there:
        raise ValueError(f"{path}: frame: 'world' needs {' or '.join(WORLD)}, which the file does not have")
    return there and frame != "camera"


def _finite_ground(path: Path, columns: Mapping[str, NDArray[Any]]) -> None:
    if "ground_offset" in columns and not np.isfinite(columns["ground_offset"]).all():
        raise ValueError(f"{path}: ground_offset: expected metres in every row, got NaN or infinity")


def _finite_rows(values: NDArray[Any]) -> NDArray[np.bool_]:
    return np.isfinite(np.asarray(values).reshape(len(values), -1)).all(axis=1)


def millimetres_or_metres(translation: Array) -> Array:
    """Millimetres, as Human3.6M's and MPI-INF-3DHP's calibrations have them, into metres; cameras stand within 20 m."""
    far = np.nanmedian(np.abs(translation).max(axis=-1)) > 20
    return translation / 1000 if far else translation
