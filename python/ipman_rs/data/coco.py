"""COCO 2014: people in photos with labelled keypoints, in SPIN's form (see `spin`).

    coco_2014_train.npz        12 or more of the 12 main joints labelled; `part`, `openpose`
    coco_2014_train_eft.npz    the same people with EFT's SMPL in the camera's axes

Images: `train2014/COCO_train2014_000000000036.jpg`. Several people may be in one: the second's frame ends in `#1`, the
third's in `#2`, in the order of the file. Photos: no metres, no world, no ground, no camera.

Where it comes from: cocodataset's own site for the images, the repository of SPIN (or EFT) for the annotations.
"""

from __future__ import annotations

from . import naming, spin

NAME = "coco"
FORM = spin.Form(
    NAME,
    {"train": "coco_2014_train.npz", "train-eft": "coco_2014_train_eft.npz"},
    people=naming.occurrence,
    wanted={"part": "no labelled keypoints"},
)

open, check = FORM.open, FORM.check
