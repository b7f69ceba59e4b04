"""MPII Human Pose: people in photos with 16 labelled joints, in SPIN's form (see `spin`).

    mpii_train.npz        people with all joints labelled; `part`, `openpose`
    mpii_train_eft.npz    with EFT's SMPL in the camera's axes

Images: `images/015601864.jpg`. Several people may be in one: the second's frame ends in `#1`, in the order of the file.
Photos: no metres, no world, no ground, no camera.

Where it comes from: the data set's own site for the images, the repository of SPIN (or EFT) for the annotations.
"""

from __future__ import annotations

from . import naming, spin

NAME = "mpii"
FORM = spin.Form(
    NAME,
    {"train": "mpii_train.npz", "train-eft": "mpii_train_eft.npz"},
    people=naming.occurrence,
    wanted={"part": "no labelled keypoints"},
)

open, check = FORM.open, FORM.check
