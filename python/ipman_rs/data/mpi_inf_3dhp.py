"""MPI-INF-3DHP: studio and outdoor recordings without markers, in SPIN's form (see `spin`).

    mpi_inf_3dhp_train.npz     every tenth image of S1 to S8, with SMPL fitted to several views where has_smpl is 1
    mpi_inf_3dhp_valid.npz     the test set, TS1 to TS6: joints of a skeleton of one size, pixels, boxes
    mpi_inf_3dhp_train_world.npz    IPMAN's: with S_world, cam_r, cam_t and cam_k

Images: `S1/Seq1/imageFrames/video_0/frame_000001.jpg` and `mpi_inf_3dhp_test_set/TS1/imageSequence/img_000001.jpg`. The
videos have 25 or 50 Hz, the rows are thinned out: no frame rate is given.

World, in IPMAN's file only: metres, y up. The height of the floor is in no file: without `height` there is no ground.
Camera: X_c = cam_r X_w + cam_t, metres (the calibration's millimetres are recognised).

Where it comes from: the data set's own site for images and calibration, the repository of SPIN for the annotations.
"""

from __future__ import annotations

from . import naming, spin

NAME = "mpi-inf-3dhp"


def label(image: str) -> tuple[str, str]:
    """The frame's name is the path, the sequence its folder: one video."""
    name = naming.stem(image)
    return name, name.rpartition("/")[0] or name


FORM = spin.Form(
    NAME,
    {
        "valid": "mpi_inf_3dhp_valid.npz",
        "train": "mpi_inf_3dhp_train.npz",
        "train-world": "mpi_inf_3dhp_train_world.npz",
    },
    label=label,
    up=(0.0, 1.0, 0.0),
    camera_t=lambda _r, t, _images: spin.millimetres_or_metres(t),
    wanted={"S": "joints in the camera's axes: no MPJPE without them"},
)

open, check = FORM.open, FORM.check
