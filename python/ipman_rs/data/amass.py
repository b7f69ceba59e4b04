"""AMASS: motion capture as bodies, in `.npz` files.

    CMU/01/01_01_poses.npz            SMPL+H: poses (F, 156), betas (16,), trans (F, 3) m, mocap_framerate, gender
    CMU/01/01_01_stageii.npz          SMPL-X: poses (F, 165), betas (16,), trans, mocap_frame_rate, gender

betas may have a row for each frame, too. The folder of all of AMASS, or of any of its data sets, or one file; shape.npz
and *_stagei.npz are passed over. Of the files only the headers are read when it is opened, and a sample of the frames.

World: metres, z up, the floor at z = 0 (fitted by each capture, so by some centimetres). 60 to 250 Hz by file:
`frame_rate=30` takes the nearest earlier frame of each thirtieth of a second. Hands are absolute: load the body with
`flat_hand_mean=True`. No cameras or images. Splits are those usual for AMASS, by data set: train, vald, test.

Where it comes from: the project's own site, AMASS. MoYo is there in this form, too.
"""

from __future__ import annotations

import os
from functools import partial
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ipman_rs.body.formats import FORMATS
from ipman_rs.files import safe_npz
from ipman_rs.ground import Ground

from . import sequences
from .check import Finding
from .frames import DataSet, Frames

NAME = "amass"

Array = NDArray[np.float64]

SPLITS = {
    "vald": ("HumanEva", "MPI_HDM05", "HDM05", "SFU", "MPI_mosh", "MoSh"),
    "test": ("Transitions_mocap", "Transitions", "SSM_synced", "SSM"),
    "train": (
        "CMU", "MPI_Limits", "PosePrior", "TotalCapture", "Eyes_Japan_Dataset", "EyesJapanDataset", "KIT", "BML",
        "BMLrub", "BioMotionLab_NTroje", "EKUT", "TCD_handMocap", "TCDHands", "ACCAD",
    ),
}  # fmt: skip
BODIES = {3 * len(FORMATS[name].joints): name for name in ("smpl", "smplh", "smplx")}  # by the columns of poses
RATES = ("mocap_framerate", "mocap_frame_rate")
REQUIRED = ("poses", "betas", "trans")


def open(path: str | os.PathLike[str], split: str | None = None, *, frame_rate: float | None = None) -> DataSet:
    """The motions of a file or folder, a sequence each.

    `frame_rate`: Hz, of what is taken of each motion; None: every frame. Raises ValueError naming the file for what is
    missing, damaged, of unequal lengths, of another body than the rest, or in units or axes that cannot be.
    """
    if frame_rate is not None and not frame_rate > 0:
        raise ValueError(f"frame_rate: expected Hz above 0, got {frame_rate}")
    root = Path(path)
    files = _motions(root, split)
    motions = [_header(file) for file in files]
    other = next((number for number, (width, *_) in enumerate(motions) if width != motions[0][0]), None)
    if other is not None:
        raise ValueError(
            f"{files[other]}: poses: expected {motions[0][0]} columns as in {files[0].name}, got {motions[other][0]}; "
            "open the bodies of SMPL+H and of SMPL-X apart"
        )
    taken = [_select_rows(count, rate, frame_rate) for _, count, rate in motions]

    def sequence(index: int) -> Frames:
        return _frames(files[index], _name(files[index], root), taken[index], frame_rate or motions[index][2])

    return sequences.require_plausible(path, sequences.sequences([len(rows) for rows in taken], sequence, path))


def check(path: str | os.PathLike[str]) -> list[Finding]:
    """How many motions of which data sets there are, which cannot be read, and whether units and axes can be right."""
    root = Path(path)
    try:
        files = _motions(root, None)
    except ValueError as error:
        return [Finding("missing", str(error), "expected a folder such as AMASS, with CMU/01/01_01_poses.npz in it")]
    findings = [Finding("ok", f"{len(files)} motions")]
    there = {part for file in files for part in file.relative_to(root).parts[:-1]} if root.is_dir() else set()
    for split, names in SPLITS.items():
        has = [name for name in names if name in there]
        if has:
            findings.append(Finding("ok", f"{split}: {', '.join(has)}"))
        elif root.is_dir():
            findings.append(Finding("missing", f"{split}: none of {', '.join(names)}"))
    whole = []
    for file in files:
        try:
            _header(file)
            whole.append(file)
        except ValueError as error:
            findings.append(Finding("wrong", str(error), "download it again"))
    named = {file: _name(file, root) for file in whole}
    return findings + sequences.check_sequences(
        [(name, partial(_all_frames, file, name)) for file, name in named.items()]
    )


def _motions(root: Path, split: str | None) -> list[Path]:
    if split is not None and split not in SPLITS:
        raise ValueError(f"split: expected one of {', '.join(SPLITS)}, got {split!r}")
    files = sorted(root.glob("**/*.npz")) if root.is_dir() else [root]
    files = [file for file in files if file.name != "shape.npz" and not file.name.endswith("_stagei.npz")]
    if split is not None:
        files = [file for file in files if set(file.relative_to(root).parts[:-1]) & set(SPLITS[split])]
    if not files or not files[0].is_file():
        what = "a motion (.npz)" if split is None else f"motions of {', '.join(SPLITS[split])}"
        raise ValueError(f"{root}: expected {what}, {'found none' if root.exists() else 'no such file or folder'}")
    return files


def _header(file: Path) -> tuple[int, int, float]:
    """Columns of the poses, frames, and Hz."""
    there = safe_npz.names(file)
    lacking = [name for name in REQUIRED if name not in there]
    if lacking:
        raise ValueError(f"{file}: no {', '.join(lacking)} among its arrays ({', '.join(sorted(there)) or 'none'})")
    poses, trans = safe_npz.shape_of(file, "poses"), safe_npz.shape_of(file, "trans")
    if len(poses) != 2 or poses[1] not in BODIES:
        widths = ", ".join(map(str, BODIES))
        raise ValueError(f"{file}: poses: expected (F, n) with n of {widths}, got {poses}")
    if trans != (poses[0], 3):
        raise ValueError(f"{file}: trans: expected ({poses[0]}, 3) as poses has {poses[0]} frames, got {trans}")
    betas = safe_npz.shape_of(file, "betas")
    if len(betas) not in (1, 2) or betas[:-1] not in ((), (1,), (poses[0],)):
        raise ValueError(f"{file}: betas: expected (n,) or ({poses[0]}, n), a row for each frame, got {betas}")
    if not poses[0]:
        raise ValueError(f"{file}: expected frames, the motion is empty")
    name = next((name for name in RATES if name in there), None)
    if name is None:
        raise ValueError(f"{file}: expected {' or '.join(RATES)}, found neither")
    rate = np.unique(safe_npz.read(file, name))  # some files have it for each frame
    if rate.size != 1 or rate.dtype.kind not in "fiu" or not 0 < float(rate.reshape(())) < 1e4:
        raise ValueError(f"{file}: {name}: expected Hz, got {rate!r:.60}")
    return poses[1], poses[0], float(rate.reshape(()))


def _select_rows(count: int, rate: float, wanted: float | None) -> NDArray[np.int64]:
    """The numbers of the frames that are taken of a motion."""
    if wanted is None or wanted >= rate:
        return np.arange(count)
    step = rate / wanted
    rows = np.floor(np.arange(int(np.ceil(count / step))) * step + 1e-9).astype(np.int64)
    return rows[rows < count]


def _name(file: Path, root: Path) -> str:
    """Of a motion: its path in the folder that was opened."""
    return file.relative_to(root if root.is_dir() else root.parent).with_suffix("").as_posix()


def _all_frames(file: Path, name: str) -> Frames:
    _, count, rate = _header(file)
    return _frames(file, name, np.arange(count), rate)


def _frames(file: Path, name: str, rows: NDArray[np.int64], rate: float) -> Frames:
    poses, trans = _numbers(file, "poses"), _numbers(file, "trans")
    betas = np.atleast_2d(_numbers(file, "betas"))
    gender = _gender(file)
    count = len(rows)
    frames = Frames(
        names=np.array([f"{name}/{row:05d}" for row in rows.tolist()]),
        sequences=np.full(count, name),
        ground=Ground.z_up(),
        frame_rate=rate,
        body=BODIES[poses.shape[1]],
        genders=np.full(count, gender),
        pose=poses[rows].reshape(count, -1, 3),
        betas=betas[rows] if len(betas) > 1 else np.broadcast_to(betas, (count, betas.shape[1])),
        transl=trans[rows],
    )
    return sequences.require_plausible_units(file, frames)


def _numbers(file: Path, name: str) -> Array:
    array = safe_npz.read(file, name)
    if array.dtype.kind not in "fiu":
        raise ValueError(f"{file}: {name}: expected numbers, got type {array.dtype}")
    return array.astype(np.float64)


def _gender(file: Path) -> str:
    """As text; some files have it as bytes, and some none."""
    if "gender" not in safe_npz.names(file):
        return "neutral"
    value = safe_npz.read(file, "gender").reshape(-1)
    if value.dtype.kind not in "US" or len(value) != 1:
        raise ValueError(f"{file}: gender: expected a word, got {value!r:.60}")
    gender = value[0].decode("latin1") if value.dtype.kind == "S" else str(value[0])
    if gender not in ("neutral", "female", "male"):
        raise ValueError(f"{file}: gender: expected neutral, female or male, got {gender!r}")
    return gender
