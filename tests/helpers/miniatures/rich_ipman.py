"""Miniature rich_world_*.npz: IPMAN's file of RICH, z up, a floor a row, cam_t (N, 1, 3) of two frames added up."""

from __future__ import annotations

import numpy as np

from . import spin

FLOOR = 0.3


def write(folder, name="rich_world_test_onlycam0_new.npz", count=6, cameras=(0,), **changes):
    """A frame a row, seen by the cameras in turn. X_c = cam_r (X_w + cam_t) holds for camera 0 alone."""
    arrays, truth = spin.rows(count, range(24), floor=FLOOR)
    sequence = "2021-06-15_Multi_IOI_ID_00186_Yoga1"
    which = [cameras[row % len(cameras)] for row in range(count)]
    arrays["imgname"] = np.array(
        [f"/rich/{sequence}/data/{row:05d}/00/images_orig_720p/{row:05d}_{which[row]:02d}.png" for row in range(count)]
    )
    arrays["cam_t"] = np.array([[row_r.T @ t] for row_r, t in zip(arrays["cam_r"], truth["t"], strict=True)])
    arrays["transl_world"] = truth["feet"] + np.array([0.0, 0.0, 1.2])
    arrays["shape"] = np.zeros((count, 10))
    arrays["ground_offset"] = np.full(count, FLOOR)
    arrays["in_bos_label"] = np.ones((count, 1), np.int64)
    arrays["contact_label"] = np.ones((count, 1), np.int64)
    arrays["openpose"] = np.zeros((count, 25, 3))
    truth["names"] = [f"{sequence}/{row:05d}_{which[row]:02d}" for row in range(count)]
    return spin.save(folder / name, arrays, changes), truth
