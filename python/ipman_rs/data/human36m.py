"""Human3.6M: studio recordings, in SPIN's form with IPMAN's additions (see `spin`).

    h36m_valid_protocol1.npz, h36m_valid_protocol2.npz    subjects 9 and 11, all cameras or the frontal one
    h36m_only_S1_valid_protocol1.npz                      subject 1
    h36m_train_world.npz                                  subjects 1, 5, 6, 7, 8, with MoSh's SMPL in the world

Images may be written in SPIN's way, `S9_Directions_1.60457274_000001.jpg`, or in IPMAN's,
`…/Images/S9/Directions_1.60457274/000001.jpg`; the frame's name is `S9/Directions_1.60457274/000001` either way.
Videos have 50 Hz; the validation files keep every fifth image.

World: metres, z up, the floor at z = -0.095 (IPMAN's value). S_world are the marker system's joints, pose_world and
transl_world are SMPL's. Camera: X_c = cam_r X_w + cam_t, cam_t (N, 3, 1) in millimetres, as the calibration has it; one
in metres is recognised. Lens distortion is not in the file: pixels are right within some pixels.

Where it comes from: register at Human3.6M's own site for the recordings and run the preprocessing of IPMAN's (or,
without the world, SPIN's) repository; MoSh's parameters are not given out.
"""

from __future__ import annotations

import re

from . import spin

NAME = "human36m"
IMAGE = re.compile(r"(S\d+)[/_]([^/]+\.\d{8})[/_](\d{6})\.\w+$")


def label(image: str) -> tuple[str, str]:
    """`S9/Directions_1.60457274/000001` and `S9/Directions_1.60457274`."""
    match = IMAGE.search(image)
    if match is None:
        return spin.image_by_itself(image)
    sequence = f"{match[1]}/{match[2]}"
    return f"{sequence}/{match[3]}", sequence


FORM = spin.Form(
    NAME,
    {
        "valid-p2": "h36m_valid_protocol2.npz",
        "valid-p1": "h36m_valid_protocol1.npz",
        "valid-s1": "h36m_only_S1_valid_protocol1.npz",
        "train": "h36m_train_world.npz",
    },
    label=label,
    up=(0.0, 0.0, 1.0),
    height=-0.095,
    video_rate=50.0,
    camera_t=lambda _r, t, _images: spin.millimetres_or_metres(t),
    wanted={
        "S": "joints in the camera's axes: no MPJPE without them",
        "S_world": "joints in the world: predictions cannot be placed on the floor without them",
        "cam_r": "no way from the camera to the world",
        "cam_t": "no projection into the image",
        "cam_k": "no projection into the image",
    },
)

open, check = FORM.open, FORM.check
