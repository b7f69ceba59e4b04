"""Miniature mpi_inf_3dhp_*.npz: bodies in the camera's axes; IPMAN's file has a world with y up."""

from __future__ import annotations

import numpy as np

from . import spin


def write(folder, name="mpi_inf_3dhp_train.npz", count=8, world=False, **changes):
    """Rows with SMPL in every second (has_smpl), and the world's arrays where asked for."""
    up = (0.0, 1.0, 0.0)
    arrays, truth = spin.rows(count, spin.H36M_17, up=up)
    arrays["imgname"] = np.array([f"S1/Seq1/imageFrames/video_0/frame_{100 * row + 1:06d}.jpg" for row in range(count)])
    if world:
        arrays["cam_t"] = truth["t"]
    else:
        arrays = {each: arrays[each] for each in ("imgname", "center", "scale", "part", "S")}
    arrays.pop("pose_world", None)
    arrays["pose"] = np.zeros((count, 72))
    arrays["pose"][:, 0] = np.pi  # upright in a camera whose y points down
    arrays["shape"] = np.ones((count, 10))
    arrays["has_smpl"] = (np.arange(count) % 2).astype(np.float64)
    truth["names"] = [str(image).removesuffix(".jpg") for image in arrays["imgname"]]
    return spin.save(folder / name, arrays, changes), truth
