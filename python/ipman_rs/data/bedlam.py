"""BEDLAM: rendered people in motion, one `.npz` per scene, as the project's own preprocessing writes it.

    20221010_3-10_500_batch01hand_zoom_suburb_d_6fps.npz …    in the folder, or in its processed_labels

One row per person and image: imgname `seq_000000/seq_000000_0125.png`, center (2,) px, scale = side of the box / 200,
gender, pose_world and pose_cam (165,) SMPL-X or (72,) SMPL, hands relative to the flat hand (load the body with
flat_hand_mean=True), shape (10,), (11,) or (16,), trans_world and trans_cam (3,) m, cam_int (3, 3) px, cam_ext (4, 4),
gtkps (K, 2 or 3) px. Arrays are mapped into memory (see `rows`); motion_info, Python objects, is not read.

World: metres, **y down**. pose_world and trans_world stand in the axes of a camera that neither pitches nor rolls: x
right, y down, z forward. The origin is the person's own, so two people of one image do not share their world, and their
cameras differ. Camera: X_c = cam_ext X_w, pixels K X_c / z. (trans_cam lacks cam_ext's translation; it is not needed.)
The height of the floor is in no file: without `height` (metres along up, -y, in the person's world) there is no ground.

Images have 30 Hz, files `_6fps` every fifth. Names are `SCENE/seq_000000_0125`, with `#1`, `#2` … for the second, third
… person of the sequence. In the scenes called closeup the images lie on their side: turn them clockwise.

Where it comes from: register at BEDLAM's own site for images and labels.
"""

from __future__ import annotations

import os
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ipman_rs.body.formats import FORMATS
from ipman_rs.ground import Ground

from . import naming
from .check import Finding, check_frames, raise_if_wrong, sample, stance
from .frames import Cameras, Frames, Rows
from .joined import Joined
from .rows import TEXT, RowFile
from .spin import OPENPOSE, genders

NAME = "bedlam"
UP = (0.0, -1.0, 0.0)
RATE = 30.0
SHAPES: dict[str, tuple[int, ...] | str] = {
    "imgname": TEXT, "center": (2,), "scale": (), "pose_world": (-1,), "trans_world": (3,), "shape": (-1,),
    "cam_int": (3, 3), "cam_ext": (4, 4), "gender": TEXT, "gtkps": (-1, -1), "hand_det_conf": (-1,),
}  # fmt: skip
REQUIRED = ("imgname", "center", "scale", "pose_world", "trans_world", "shape", "cam_int", "cam_ext")
BODIES = {3 * len(FORMATS[name].joints): name for name in ("smpl", "smplx")}  # by the columns of pose_world


class BedlamScene:
    """The rows of one file, as Frames."""

    def __init__(self, path: Path, height: float | None = None) -> None:
        self.file, self.height = RowFile(path, SHAPES, REQUIRED), height
        columns = self.file.arrays["pose_world"].shape[1]
        if columns not in BODIES:
            raise ValueError(f"{path}: pose_world: expected 165 columns (SMPL-X) or 72 (SMPL), got {columns}")
        self.body, self.num_joints = BODIES[columns], columns // 3
        images = self.file.texts("imgname", slice(None))
        sequences = np.array([image.partition("/")[0] for image in images.tolist()], np.str_)
        self.people = naming.person(images, sequences)
        stems = [naming.stem(image) for image in images[:64].tolist()]
        self.frame_rate = naming.frame_rate(list(zip(stems, sequences.tolist(), strict=False)), RATE)

    def __len__(self) -> int:
        return len(self.file)

    def __getitem__(self, rows: Rows) -> Frames:
        images, people = self.file.texts("imgname", rows), self.people[rows]
        scene = self.file.path.stem
        folders = [f"{scene}/{image.partition('/')[0]}" for image in images.tolist()]
        names = [f"{scene}/{naming.stem(image).rpartition('/')[2]}" for image in images.tolist()]
        pose, camera = self.file.numbers("pose_world", rows), self.file.numbers("cam_ext", rows)
        side = 200 * self.file.numbers("scale", rows)[:, None]
        return Frames(
            names=naming.numbered(names, people),
            sequences=naming.numbered(folders, people),
            ground=None if self.height is None else Ground(UP, self.height),
            frame_rate=self.frame_rate,
            body=self.body,
            genders=self._genders(rows),
            pose=pose.reshape(-1, self.num_joints, 3),
            betas=self.file.numbers("shape", rows),
            transl=self.file.numbers("trans_world", rows),
            images=images,
            cameras=Cameras(camera[:, :3, :3], camera[:, :3, 3], self.file.numbers("cam_int", rows)),
            **self._keypoints(rows),
            boxes=np.concatenate([self.file.numbers("center", rows) - side / 2, side, side], axis=1),
        )

    def _genders(self, rows: Rows) -> NDArray[np.str_]:
        """11 or 16 betas are those of the neutral model, whatever the person's own gender."""
        if self.file.arrays["shape"].shape[1] > 10 or "gender" not in self.file:
            return np.full(len(self.people[rows]), "neutral")
        return genders(self.file, rows)

    def _keypoints(self, rows: Rows) -> dict[str, Any]:
        """The first of gtkps: the joints of the body model, in BEDLAM2's files OpenPose's."""
        if "gtkps" not in self.file:
            return {}
        names = OPENPOSE if "hand_det_conf" in self.file else FORMATS[self.body].joints
        points = self.file.numbers("gtkps", rows)[:, : len(names), :2]
        return {"keypoints": np.dstack([points, np.ones(points.shape[:2])]), "keypoint_names": names[: points.shape[1]]}


def open(path: str | os.PathLike[str], split: None = None, height: float | None = None) -> Joined | BedlamScene:
    """Frames of a file, or of all `.npz` files of a folder one after the other; there are no splits.

    Raises ValueError naming the file for what is missing, damaged, of a wrong shape, or not metres, radians and y down.
    """
    place = Path(path)
    if split is not None:
        raise ValueError(f"split: bedlam has none, got {split!r}")
    files = _files(place)
    if not files:
        raise ValueError(f"{place}: {'no .npz file in it' if place.is_dir() else 'no such file or folder'}")
    scenes = [BedlamScene(file, height) for file in files]
    for scene in scenes:
        raise_if_wrong(scene.file.path, _check_scene(scene))
    return scenes[0] if len(scenes) == 1 else Joined(scenes)


def check(path: str | os.PathLike[str]) -> list[Finding]:
    """What is there, missing and wrong, in a file or in each file of a folder."""
    place = Path(path)
    if not _files(place):
        return [Finding("wrong", f"{place}: {'no .npz file in it' if place.is_dir() else 'no such file or folder'}")]
    return [finding for file in _files(place) for finding in _check_file(file)]


def _check_file(file: Path) -> list[Finding]:
    try:
        scene = BedlamScene(file)
        findings = [Finding("ok", f"{len(scene)} rows with {', '.join(scene.file)}")]
        findings += _check_scene(scene)
        findings += scene.file.scan()
    except ValueError as error:
        return [Finding("wrong", str(error))]
    return [Finding(each.level, f"{file.name}: {each.what}", each.advice) for each in findings]


def _files(place: Path) -> list[Path]:
    return [place] if place.is_file() else sorted(place.glob("*.npz")) or sorted(place.glob("processed_labels/*.npz"))


def _check_scene(scene: BedlamScene) -> list[Finding]:
    """The axes are judged without a floor, too."""
    frames = sample(scene)
    return check_frames(frames) + (stance(frames, Ground(UP)) if frames.ground is None else [])
