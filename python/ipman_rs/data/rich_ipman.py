"""RICH as IPMAN's evaluation has it: one `.npz` in SPIN's form with the world's additions (see `spin`).

    rich_world_test_onlycam0_new.npz, rich_world_test_new.npz    test sequences, camera 0 or all
    rich_world_val_onlycam0_new.npz, rich_world_val_new.npz      validation sequences; all but camera 0 train

Images: `…/SEQUENCE/data/00042/00/images_orig_720p/00042_00.png`, the frame's number and the camera's; pixels are those
of the images at a quarter of their size. The names of the frames are `SEQUENCE/00042_00`.

World: that of the laser scan, metres, z up, the floor at z = ground_offset. SMPL, converted from the data set's SMPL-X.
Camera: cam_t (N, 1, 3) adds up two frames: X_c = cam_r (X_w + cam_t) holds for camera 0; of the others the place is
lost, the translation is NaN here. cam_r is right for all. The data set's own files (`rich`) have all cameras.

Where it comes from: RICH's own site; then the preprocessing of IPMAN's repository.
"""

from __future__ import annotations

import re

import numpy as np
from numpy.typing import NDArray

from . import spin
from .frames import Array

NAME = "rich-ipman"
IMAGE = re.compile(r"([^/]+)/data/(?:.*/)?(\d+)_(\d+)\.\w+$")


def label(image: str) -> tuple[str, str]:
    """`SEQUENCE/00042_00` and `SEQUENCE/00`: what one camera saw."""
    match = IMAGE.search(image)
    if match is None:
        return spin.image_by_itself(image)
    return f"{match[1]}/{match[2]}_{match[3]}", f"{match[1]}/{match[3]}"


def camera_t(rotation: Array, translation: Array, images: NDArray[np.str_]) -> Array:
    """t of X_c = R X_w + t for camera 0, NaN for the others."""
    first = np.array([int(label(str(image))[0].rpartition("_")[2]) == 0 for image in images], bool)
    return np.where(first[:, None], np.einsum("fij,fj->fi", rotation, translation), np.nan)


FORM = spin.Form(
    NAME,
    {
        "test": "rich_world_test_onlycam0_new.npz",
        "test-all": "rich_world_test_new.npz",
        "val": "rich_world_val_onlycam0_new.npz",
        "train": "rich_world_val_new.npz",
    },
    label=label,
    up=(0.0, 0.0, 1.0),
    camera_t=camera_t,
    wanted={
        "pose_world": "no BoSE of the true bodies",
        "transl_world": "no BoSE of the true bodies",
        "shape": "no BoSE of the true bodies",
        "ground_offset": "no floor",
        "cam_r": "no way from the camera to the world",
        "cam_t": "no projection into the image",
        "cam_k": "no projection into the image",
    },
)

open, check = FORM.open, FORM.check
