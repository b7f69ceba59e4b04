"""Leeds Sports Poses: one person a photo with 14 labelled joints, in SPIN's form (see `spin`).

    lsp_dataset_test.npz              photos 1001 to 2000, low resolution
    lsp_dataset_original_train.npz    photos 1 to 1000, high resolution
    hr-lspet_train.npz                the extended training set, high resolution (HR-LSPET)
    hr-lspet_train_eft.npz            with EFT's SMPL in the camera's axes

Images: `images/im1001.jpg`, and `im00001.png` of HR-LSPET. Photos: no metres, no world, no ground, no camera.

Where it comes from: the data set's own site for the images, the repository of SPIN (or EFT) for the annotations.
"""

from __future__ import annotations

import os

from . import spin
from .check import Finding

NAME = "lsp"
FORM = spin.Form(
    NAME,
    {
        "test": "lsp_dataset_test.npz",
        "train": "lsp_dataset_original_train.npz",
        "extended": "hr-lspet_train.npz",
        "extended-eft": "hr-lspet_train_eft.npz",
    },
    wanted={"part": "no labelled keypoints"},
)


def open(path: str | os.PathLike[str], split: str | None = None) -> spin.Spin:
    """Frames of the file, or of the split's file in the folder; see `spin.open` for the errors."""
    return spin.open(FORM, path, split)


def check(path: str | os.PathLike[str]) -> list[Finding]:
    """What is there, missing and wrong."""
    return spin.check(FORM, path)
