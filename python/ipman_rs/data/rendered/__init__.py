"""Rendered images of the embedded body on a known floor, as `ipman data render` writes them.

data = ipman_rs.data.open("rendered", "out/images", split="train")   # Frames: labels, cameras, ground
data.image(5)                                                        # (S, S, 3) uint8
images = RenderedImages(Path("out/images"), "train")                 # of .torch_images: for a torch DataLoader

The data set comes from `ipman data render`: a folder with index.json and shards in WebDataset's layout (see `layout`).
The world's y axis points up, the floor is y = 0, lengths are metres, pixels count from the image's upper left corner;
images have no frame rate. A sample consists of

.jpg    RGB, square
.npz    float32: pose (24, 3) rotation vectors, the root's in the world; betas (10,); transl (3,); joints (24, 3) in the
        world; camera_rotation (3, 3), camera_translation (3,), intrinsics (3, 3): X_c = R X + t, x = K X_c / z;
        keypoints (K, 3) x, y, and 1 inside the image, else 0; box (4,) x, y, width, height around the person;
        and visible (K,) bool: inside the image and not behind another part of the body
.json   name, split, seed, body ("anny-lite" or "anny"), family and name of the pose, kind ("static", "tipped" or
        "jumping"), static, surroundings
"""

from __future__ import annotations

import os
from pathlib import Path

import numpy as np

from ..check import SAMPLE, Finding, check_frames
from .layout import SPLITS
from .reader import BadSample, Labels, Rendered

NAME = "rendered"

__all__ = ["NAME", "BadSample", "Labels", "Rendered", "check", "open"]


def open(path: str | os.PathLike[str], split: str | None = None) -> Rendered:
    """The images of a split ("train", "val" or "test"), or all. ValueError for a folder that has no (whole) images."""
    return Rendered(Path(path), split)


def check(path: str | os.PathLike[str]) -> list[Finding]:
    """What a folder holds, every image decoded."""
    try:
        data = open(path)
    except ValueError as error:
        return [Finding("wrong", str(error))]
    for row in range(len(data)):
        try:
            data.labels(row)
            data.image(row)
        except BadSample:
            continue
    counts = ", ".join(f"{data.index['counts'][split]} {split}" for split in SPLITS)
    findings = [Finding("ok", f"{counts} images of {data.index['settings']['body']} in {len(data.shards)} shards")]
    findings += [
        Finding("wrong", f"{name}: {why}", "render the folder again") for name, why in list(data.bad.items())[:10]
    ]
    if len(data.bad) > 10:
        findings.append(Finding("wrong", f"{len(data.bad)} bad samples in all"))
    good = np.flatnonzero(~np.isin(data.names, list(data.bad)))
    return findings + (check_frames(data[good[:: -(-len(good) // SAMPLE)]]) if len(good) else [])
