"""The pieces in which files store a pose: global_orient, body_pose and so on, as the smplx package names them."""

from __future__ import annotations

from . import joints
from .model import BodyModel

# The names that the smplx package, and `ipman analyze`, give the pieces of a pose, by joints.
_PIECES = {
    "jaw_pose": ("jaw",),
    "leye_pose": ("left_eye_smplhf",),
    "reye_pose": ("right_eye_smplhf",),
    "left_hand_pose": joints.LEFT_HAND,
    "right_hand_pose": joints.RIGHT_HAND,
}


def joints_of(body: BodyModel) -> dict[str, list[int]]:
    """The joints of each piece of a stored pose that the body has."""
    column = {name: index for index, name in enumerate(body.joint_names)}
    whole = joints.SMPL if set(joints.SMPL) <= set(column) else joints.BODY
    pieces = {"global_orient": joints.BODY[:1], "body_pose": whole[1:], **_PIECES}
    return {name: [column[joint] for joint in piece] for name, piece in pieces.items() if set(piece) <= set(column)}
