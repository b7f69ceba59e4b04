"""Poses in files: which arrays hold a pose, or a piece of it, and the joints that each turns.

AMASS, the smplx package, SMPL and SMPL-X name them differently; all are rotation vectors (T, 3 n) or (T, n, 3), in
radians, each joint relative to its parent.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from .joints import BODY, LEFT_HAND, RIGHT_HAND, SMPL, SMPLH, SMPLX
from .model import BodyModel

WHOLE_POSES = ("poses", "fullpose", "pose", "full_pose")
# Arrays that hold a piece of the pose, and the joints of that piece by its number of columns / 3.
PIECES: dict[str, tuple[tuple[str, ...], ...]] = {
    "global_orient": (BODY[:1],),
    "root_orient": (BODY[:1],),
    "body_pose": (BODY[1:], SMPL[1:]),
    "pose_body": (BODY[1:], SMPL[1:]),
    "left_hand_pose": (LEFT_HAND,),
    "right_hand_pose": (RIGHT_HAND,),
    "pose_hand": ((*LEFT_HAND, *RIGHT_HAND),),
    "jaw_pose": (("jaw",),),
    "pose_jaw": (("jaw",),),
    "leye_pose": (SMPLX[23:24],),
    "reye_pose": (SMPLX[24:25],),
    "pose_eye": (SMPLX[23:25],),
}
NAMES = (*WHOLE_POSES, *PIECES)
_WHOLE = (BODY, SMPL, SMPLH, SMPLX)

Array = NDArray[Any]


class Piece(NamedTuple):
    """Rotation vectors (T, n, 3) of the joints (n,) of these names."""

    rotations: Array
    joints: tuple[str, ...]


def read(first: Callable[..., Array | None]) -> list[Piece]:
    """The pieces of a stored pose; `first(*names)` gives the first of these arrays that there is, or None.

    Raises:
        ValueError: an array has another shape than its joints need, or pieces have unequal numbers of frames.
    """
    whole = first(*WHOLE_POSES)
    if whole is not None:
        return [_whole(whole)]
    pieces = [_piece(name, array) for name in PIECES if (array := first(name)) is not None]
    counts = {len(piece.rotations) for piece in pieces}
    if len(counts - {1}) > 1:
        raise ValueError(f"pose arrays have {sorted(counts)} frames; expected equal numbers")
    return pieces


def place(pieces: Sequence[Piece], joint_names: Sequence[str], length: int) -> NDArray[np.float64]:
    """The pose (length, J, 3) on joints of these names, zero where no piece turns them; a piece of one frame is that of
    all."""
    pose = np.zeros((length, len(joint_names), 3))
    for rotations, joints in pieces:
        here = [k for k, name in enumerate(joints) if name in joint_names]
        pose[:, [joint_names.index(joints[k]) for k in here]] = rotations[:, here]
    return pose


def joints_of(body: BodyModel) -> dict[str, list[int]]:
    """The joints of each piece that a body has, under the names that the smplx package gives the pieces."""
    column = {name: index for index, name in enumerate(body.joint_names)}
    whole = SMPL if set(SMPL) <= set(column) else BODY
    hands = {"left_hand_pose": LEFT_HAND, "right_hand_pose": RIGHT_HAND}
    face = {"jaw_pose": SMPLX[22:23], "leye_pose": SMPLX[23:24], "reye_pose": SMPLX[24:25]}
    pieces = {"global_orient": BODY[:1], "body_pose": whole[1:], **face, **hands}
    return {name: [column[joint] for joint in piece] for name, piece in pieces.items() if set(piece) <= set(column)}


def _whole(array: Array) -> Piece:
    by_columns = {3 * len(names): names for names in _WHOLE}
    by_columns[72] = SMPL
    if array.ndim >= 2 and array.shape[-1] == 3 and 3 * array.shape[-2] in by_columns:
        array = array.reshape(*array.shape[:-2], -1)
    if array.ndim == 3 and array.shape[-1] in by_columns and array.shape[0] == 1:
        array = array[0]
    if array.ndim not in (1, 2) or array.shape[-1] not in by_columns or array.size == 0:
        counts = ", ".join(str(count) for count in sorted(by_columns))
        raise ValueError(f"the pose has shape {array.shape}; expected (T, n) with n of {counts}")
    joints = by_columns[array.shape[-1]]
    return Piece(array.reshape(-1, len(joints), 3), joints)


def _piece(name: str, array: Array) -> Piece:
    choices = PIECES[name]
    if array.ndim >= 2 and array.shape[-1] == 3 and array.shape[-2] in {len(choice) for choice in choices}:
        array = array.reshape(*array.shape[:-2], -1)
    joints = next((choice for choice in choices if array.shape[-1:] == (3 * len(choice),)), None)
    if joints is None or array.ndim > 2 or array.size == 0:
        counts = " or ".join(str(3 * len(choice)) for choice in choices)
        raise ValueError(f"{name} has shape {array.shape}; expected (T, {counts}) axis-angle")
    return Piece(array.reshape(-1, len(joints), 3), joints)
