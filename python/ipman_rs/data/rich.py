"""RICH: people in scanned scenes, seen by six to eight still cameras, as the data set itself ships.

    bodies/{train,val,test}/Pavallion_000_yoga1/00045/000.pkl    SMPL-X arguments of a frame and person
    scan_calibration/Pavallion/calibration/000.xml               a camera: CameraMatrix, Intrinsics, Distortion
    scan_calibration/Pavallion/ground_mesh.ply                   the ground of the laser scan (also beside the bodies,
                                                                 bodies/{train,val,test}/SEQUENCE/ground_mesh.ply)
    multicam2world/Pavallion_multicam2world.json                 R, t, c: world = c · X R + t
    images/{train,val,test}/Pavallion_000_yoga1/cam_00/00045_00.jpeg

World of the frames: camera 0's, metres, x right, y down, z forward, since the bodies are given in it; the ground is
put into it. (The scan's own world is z up.) No `ground_mesh.ply`: no ground. 30 Hz where the numbers of the frames
follow each other. Names are `SEQUENCE/00045_00`, the frame's number and the camera's, with `#1` for the second person;
sequences are one camera's view of one person. Images keep their full size; the intrinsics know no distortion.

Hands: 12 weights a hand of SMPL-X's components: `hands=load_body(...).hands` turns them into the fingers' absolute
rotations (`flat_hand_mean=True`), without it fingers are straight.

Splits: the data set's own train, val, test, camera 0 unless `cameras` says others; and IPMAN's, of its yoga and push-up
sequences: ipman-train (all cameras but 0), ipman-val (the same sequences, camera 0) and ipman-test (all cameras).

Where it comes from: the project's own site, RICH.
"""

from __future__ import annotations

import os
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ipman_rs.body.formats import FORMATS
from ipman_rs.body.hands import Hands
from ipman_rs.body.joints import SMPLX
from ipman_rs.files import safe_pickle

from . import naming, sequences
from .check import Finding
from .frames import Cameras, DataSet, Frames
from .rich_scene import (
    RichScene,
    calibration_folder,
    ground_mesh_file,
    read_scene,
    scene_files,
    to_world_file,
)

NAME = "rich"

Array = NDArray[np.float64]

SPLITS = ("train", "val", "test")
IPMAN_YOGA = ("Pavallion_000_yoga1", "Pavallion_000_yoga2", "Pavallion_006_yoga1", "Pavallion_018_yoga1")
IPMAN = {
    "ipman-train": IPMAN_YOGA,
    "ipman-val": IPMAN_YOGA,
    "ipman-test": (
        "Pavallion_002_yoga1", "Pavallion_013_yoga2", "ParkingLot2_014_pushup2", "ParkingLot1_005_pushup1",
    ),
}  # fmt: skip
RATE = 30.0  # Hz
FEMALE = (9, 10, 12, 13, 16, 17, 18, 19, 21)  # of the subjects 0 to 21
SUBJECTS = 22
PIECES = ("global_orient", "body_pose", "jaw_pose", "leye_pose", "reye_pose")  # arrays of rotation vectors
HANDS = ("left_hand_pose", "right_hand_pose")
REQUIRED = ("transl", "global_orient", "body_pose", "betas")
IMAGES = (".jpeg", ".jpg", ".png", ".bmp")


@dataclass(frozen=True)
class View:
    """One camera's view of one person: the files of its frames, in order."""

    folder: Path  # of the sequence's bodies
    person: int  # the how-manieth in the sequence
    files: tuple[Path, ...]
    camera: int

    @property
    def sequence(self) -> str:
        return self.folder.name

    @property
    def scene(self) -> str:
        return self.sequence.partition("_")[0]


def open(
    path: str | os.PathLike[str],
    split: str | None = None,
    *,
    cameras: Sequence[int] | int | None = None,
    hands: Hands | None = None,
) -> DataSet:
    """The frames of a split (see above; None: all sequences there are), seen by these cameras.

    Only folders are listed when it is opened, and calibrations read. Raises ValueError naming the file for what is
    missing, damaged, hostile, or in units or axes that cannot be.
    """
    root = Path(path)
    folders = _folders(root, split)
    views = [view for folder in folders for view in _views(root, folder, _cameras(root, folder, split, cameras))]
    read = lru_cache(maxsize=None)(read_scene)  # of a place, whose files are those of all its sequences
    scenes = {folder: read(*scene_files(root, folder)) for folder in folders}
    _require_same_parts(root, scenes)
    rate = _rate(views)
    pictured = any(_image_folder(root, view).is_dir() for view in views)

    def sequence(index: int) -> Frames:
        frames = _frames(root, views[index], scenes[views[index].folder], hands, rate)
        return frames if not pictured else replace(frames, images=_images(root, views[index]))

    return sequences.require_plausible(root, sequences.sequences([len(view.files) for view in views], sequence, path))


def _require_same_parts(root: Path, scenes: dict[Path, RichScene]) -> None:
    """ValueError if some scenes lack what others have."""
    for what, there, file in (
        ("ground", {folder: scene.ground is not None for folder, scene in scenes.items()}, "ground_mesh.ply"),
        ("cameras", {folder: bool(scene.cameras) for folder, scene in scenes.items()}, "calibration/*.xml"),
    ):
        lacking = [folder.name for folder, has in there.items() if not has]
        if lacking and len(lacking) < len(there):
            raise ValueError(f"{root}: {what} of {', '.join(lacking)}: expected {file}, as other sequences have")


def _folders(root: Path, split: str | None) -> list[Path]:
    """The sequences' folders of a split."""
    if split is not None and split not in (*SPLITS, *IPMAN):
        raise ValueError(f"split: expected one of {', '.join((*SPLITS, *IPMAN))}, got {split!r}")
    if not (root / "bodies").is_dir():
        raise ValueError(f"{root}: expected a folder with bodies/train, bodies/val or bodies/test in it, found none")
    pattern = f"{split}/*" if split in SPLITS else "*/*"
    folders = {folder.name: folder for folder in sorted((root / "bodies").glob(pattern)) if folder.is_dir()}
    if split in IPMAN:
        lacking = [name for name in IPMAN[split] if name not in folders]
        if lacking:
            raise ValueError(f"{root}: {split}: expected bodies/*/{lacking[0]}, there is none")
        return [folders[name] for name in IPMAN[split]]
    if not folders:
        raise ValueError(f"{root}: expected sequences in bodies/{split or '*'}, found none")
    return list(folders.values())


def _cameras(root: Path, folder: Path, split: str | None, wanted: Sequence[int] | int | None) -> Sequence[int]:
    if wanted is not None:
        return (wanted,) if isinstance(wanted, int) else wanted
    if split in ("ipman-train", "ipman-test"):
        calibrated = sorted(calibration_folder(root, folder).glob("*.xml"))
        numbers = [int(file.stem) for file in calibrated if file.stem.isdigit()]
        return numbers if split == "ipman-test" else [number for number in numbers if number != 0]
    return (0,)


def _views(root: Path, folder: Path, cameras: Sequence[int]) -> list[View]:
    files = sorted(folder.glob("*/*.pkl"))
    if not files:
        raise ValueError(f"{folder}: expected bodies such as 00045/000.pkl, found none")
    people = sorted({file.stem for file in files})
    return [
        View(folder, number, tuple(file for file in files if file.stem == person), camera)
        for camera in cameras
        for number, person in enumerate(people)
    ]


def _rate(views: list[View]) -> float | None:
    """Hz; None if frames do not follow each other at one distance."""
    steps = {
        int(later.parent.name) - int(earlier.parent.name)
        for view in views
        for earlier, later in zip(view.files, view.files[1:], strict=False)
    }
    return RATE / steps.pop() if len(steps) == 1 else None


def _frames(root: Path, view: View, scene: RichScene, hands: Hands | None, rate: float | None) -> Frames:
    bodies = [_body(file, hands) for file in view.files]
    pose, betas, transl = (np.stack(part) for part in zip(*bodies, strict=True))
    count = len(view.files)
    names = [f"{view.sequence}/{file.parent.name}_{view.camera:02d}" for file in view.files]
    person = np.full(count, view.person)
    camera = scene.cameras.get(view.camera)
    if camera is None and scene.cameras:
        calibration = calibration_folder(root, view.folder) / f"{view.camera:03d}.xml"
        raise ValueError(f"{calibration}: expected the calibration of camera {view.camera}, no such file")
    spread = None if camera is None else Cameras(*(np.broadcast_to(part, (count, *part.shape)) for part in camera))
    frames = Frames(
        names=naming.numbered(names, person),
        sequences=naming.numbered([f"{view.sequence}/{view.camera:02d}"] * count, person),
        ground=scene.ground,
        frame_rate=rate,
        body="smplx",
        genders=np.full(count, _gender(view.files[0].stem)),
        pose=pose,
        betas=betas,
        transl=transl,
        cameras=spread,
    )
    return sequences.require_plausible_units(view.folder, frames)


def _body(file: Path, hands: Hands | None) -> tuple[Array, Array, Array]:
    """Pose (55, 3), betas (n,) and place (3,) of a frame."""
    if not file.parent.name.isdigit():
        raise ValueError(f"{file}: expected it in a folder with the frame's number, such as 00045")
    content = safe_pickle.read(file, "body of RICH", "an unmodified file of its bodies folder")
    lacking = [name for name in REQUIRED if name not in content]
    if lacking:
        raise ValueError(f"{file}: no {', '.join(lacking)} in it (it has {', '.join(sorted(map(str, content)))})")
    pose = np.zeros((len(SMPLX), 3))
    for name in PIECES:
        if name in content:
            joints = [SMPLX.index(joint) for joint in FORMATS["smplx"].pieces[name][0]]
            pose[joints] = _array(file, name, content[name], 3 * len(joints)).reshape(-1, 3)
    if hands is not None and all(name in content for name in HANDS):
        weights = [_array(file, name, content[name], None) for name in HANDS]
        pose[25:] = hands.mean + hands.from_components(*weights)
    return pose, _array(file, "betas", content["betas"], None), _array(file, "transl", content["transl"], 3)


def _array(file: Path, name: str, value: Any, size: int | None) -> Array:
    """The numbers behind a value of the pickle, one dimension."""
    try:
        array = safe_pickle.as_array(value)
    except ValueError as error:
        raise ValueError(f"{file}: {name}: {error}") from error
    if array.dtype.kind not in "fiu" or (size is not None and array.size != size):
        raise ValueError(f"{file}: {name}: expected {size or 'some'} numbers, got {array.dtype} of {array.shape}")
    return array.astype(np.float64).reshape(-1)


def _gender(subject: str) -> str:
    if not subject.isdigit() or int(subject) >= SUBJECTS:
        return "neutral"
    return "female" if int(subject) in FEMALE else "male"


def _image_folder(root: Path, view: View) -> Path:
    return root / "images" / view.folder.parent.name / view.sequence / f"cam_{view.camera:02d}"


def _images(root: Path, view: View) -> NDArray[np.str_]:
    """The images' paths; empty if the view has none."""
    folder = _image_folder(root, view)
    first = next((file for file in folder.glob("*") if file.suffix.lower() in IMAGES), None)
    names = (f"{file.parent.name}_{view.camera:02d}" for file in view.files)
    return np.array(["" if first is None else str(folder / name) + first.suffix for name in names])


def check(path: str | os.PathLike[str]) -> list[Finding]:
    """Which sequences there are, what belongs to each, which files cannot be read, and whether units and axes fit."""
    root = Path(path)
    try:
        folders = _folders(root, None)
    except ValueError as error:
        return [Finding("missing", str(error), "fetch the bodies of a split and unpack them")]
    counts = {split: sum(folder.parent.name == split for folder in folders) for split in SPLITS}
    findings = [
        Finding("ok", f"{len(folders)} sequences ({', '.join(f'{n} in {split}' for split, n in counts.items())})")
    ]
    for split, names in IPMAN.items():
        lacking = [name for name in names if name not in {folder.name for folder in folders}]
        if lacking:
            findings.append(Finding("missing", f"{split}: {', '.join(lacking)}"))
        else:
            findings.append(Finding("ok", f"{split}: all {len(names)} sequences"))
    read, cached_scene = [], lru_cache(maxsize=None)(read_scene)
    for folder in folders:
        findings += _check_companions(root, folder)
        try:
            scene = cached_scene(*scene_files(root, folder))
            for view in _views(root, folder, (0,)):
                read.append((view.sequence, lambda v=view, s=scene: _frames(root, v, s, None, None)))
        except ValueError as error:
            findings.append(Finding("wrong", str(error)))
    return findings + sequences.check_sequences(read)


def _check_companions(root: Path, folder: Path) -> list[Finding]:
    """What is missing beside the bodies of a sequence."""
    needed = (
        ("ground", ground_mesh_file(root, folder), "scan_calibration/SCENE/ground_mesh.ply"),
        ("way to the scan's world", to_world_file(root, folder), "multicam2world"),
        ("cameras", calibration_folder(root, folder), "scan_calibration"),
        ("images", root / "images" / folder.parent.name / folder.name, "images"),
    )
    return [
        Finding("missing", f"{folder.name}: no {what}", f"expected it in {place}")
        for what, there, place in needed
        if there is None or not there.exists()
    ]
