"""Miniature h36m_*.npz: z up, floor at -0.095 m, cam_t (N, 3, 1) in millimetres, one row an image of a video."""

from __future__ import annotations

import numpy as np

from . import spin

FLOOR = -0.095


def write(folder, name="h36m_valid_protocol2.npz", count=12, with_smpl=True, packed=False, old_names=False, **changes):
    """Two sequences with every fifth image. Returns the file and the truth (see `spin.rows`)."""
    arrays, truth = spin.rows(count, spin.H36M_17, floor=FLOOR)
    half = (count + 1) // 2
    numbers = [(f"Directions_{1 + row // half}", 5 * (row % half) + 1) for row in range(count)]
    if old_names:
        arrays["imgname"] = np.array([f"S9_{action}.60457274_{number:06d}.jpg" for action, number in numbers])
    else:
        arrays["imgname"] = np.array(
            [f"/data/h36m/Images/S9/{action}.60457274/{number:06d}.jpg" for action, number in numbers]
        )
    arrays["cam_t"] = truth["t"][:, :, None] * 1000.0
    if with_smpl:
        arrays["transl_world"] = truth["feet"] + np.array([0.0, 0.0, 1.2])  # the model's origin is at the navel
        arrays["shape"] = np.linspace(-1, 1, 10 * count).reshape(count, 10)
        arrays["in_bos_label"] = np.arange(count) % 3 - 1  # -1, 0, 1
        arrays["contact_label"] = (arrays["in_bos_label"] >= 0).astype(np.int64)
    else:
        del arrays["pose_world"]
    truth["names"] = [f"S9/{action}.60457274/{number:06d}" for action, number in numbers]
    return spin.save(folder / name, arrays, changes, packed), truth
