"""Miniature files of labelled photos in SPIN's form: COCO, MPII, LSP, HR-LSPET. Pixels only."""

from __future__ import annotations

import numpy as np

from . import spin

KINDS = {  # file -> labelled joints, names of images, people an image
    "coco_2014_train.npz": (spin.COCO_17, "train2014/COCO_train2014_{:012d}.jpg", 2),
    "mpii_train.npz": (spin.MPII_16, "images/{:09d}.jpg", 2),
    "lsp_dataset_test.npz": (spin.LSP_14, "images/im{:04d}.jpg", 1),
    "lsp_dataset_original_train.npz": (spin.LSP_14, "images/im{:04d}.jpg", 1),
    "hr-lspet_train.npz": (spin.LSP_14, "im{:05d}.png", 1),
}


def write(folder, name, count=6, eft=False, **changes):
    """`count` people. COCO's and MPII's come two an image, not next to each other."""
    known, pattern, people = KINDS[name.replace("_eft", "")]
    arrays, truth = spin.rows(count, known)
    arrays = {each: arrays[each] for each in ("center", "scale", "part")}
    images = max(count // people, 1)
    arrays["imgname"] = np.array([pattern.format(1 + row % images) for row in range(count)])
    arrays["openpose"] = np.full((count, 25, 3), 0.5)
    if eft:
        arrays |= {"pose": np.zeros((count, 72)), "shape": np.zeros((count, 10))}
        arrays["pose"][:, 0] = np.pi  # upright in a camera whose y points down
    truth["known"] = list(known)
    return spin.save(folder / name, arrays, changes), truth
