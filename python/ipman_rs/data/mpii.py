"""MPII Human Pose: people in photos with 16 labelled joints, in SPIN's form (see `spin`).

    mpii_train.npz        people with all joints labelled; `part`, `openpose`
    mpii_train_eft.npz    with EFT's SMPL in the camera's axes

Images: `images/015601864.jpg`. Several people may be in one: the second's frame ends in `#1`, in the order of the file.
Photos: no metres, no world, no ground, no camera.

Where it comes from: the data set's own site for the images, the repository of SPIN (or EFT) for the annotations.
"""

from __future__ import annotations

import os

from . import naming, spin
from .check import Finding

NAME = "mpii"
FORM = spin.Form(
    NAME,
    {"train": "mpii_train.npz", "train-eft": "mpii_train_eft.npz"},
    people=naming.occurrence,
    wanted={"part": "no labelled keypoints"},
)


def open(path: str | os.PathLike[str], split: str | None = None) -> spin.Spin:
    """Frames of the file, or of the split's file in the folder; see `spin.open` for the errors."""
    return spin.open(FORM, path, split)


def check(path: str | os.PathLike[str]) -> list[Finding]:
    """What is there, missing and wrong."""
    return spin.check(FORM, path)
