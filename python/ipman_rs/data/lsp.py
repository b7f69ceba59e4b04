"""Leeds Sports Poses: one person a photo with 14 labelled joints, in SPIN's form (see `spin`).

    lsp_dataset_test.npz              photos 1001 to 2000, low resolution
    lsp_dataset_original_train.npz    photos 1 to 1000, high resolution
    hr-lspet_train.npz                the extended training set, high resolution (HR-LSPET)
    hr-lspet_train_eft.npz            with EFT's SMPL in the camera's axes

Images: `images/im1001.jpg`, and `im00001.png` of HR-LSPET. Photos: no metres, no world, no ground, no camera.

Where it comes from: the data set's own site for the images, the repository of SPIN (or EFT) for the annotations.
"""

from __future__ import annotations

from . import spin

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

open, check = FORM.open, FORM.check
