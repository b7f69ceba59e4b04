"""Poses in files: which arrays hold a pose, or a piece of it, and the joints that each turns.

AMASS, the smplx package, SMPL, SMPL-X and ROMP name them differently. Each joint turns relative to its parent; the
numbers are rotation vectors (T, 3 n) or (T, n, 3) in radians, matrices (T, n, 3, 3) or (T, 9 n), the first two columns
of matrices (T, n, 6), or quaternions in an array whose name ends in _wxyz or _xyzw. The shape tells which. EasyMocap
has a turn of the whole body beside its poses, Rh.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from . import rotations
from .body_format import BodyFormat, Joints
from .formats import FORMATS, of_kind
from .joints import BODY
from .model import BodyModel
from .smpl_files import SMPL, SMPLX

WHOLE_POSES = ("poses", "fullpose", "pose", "full_pose", "smpl_thetas", "smpl_poses")
_VECTORS, _MATRICES, COLUMNS, _QUATERNIONS = "rotation vectors", "rotation matrices", "6D rotations", "quaternions"
_WIDTHS = {_VECTORS: 3, _MATRICES: 9, COLUMNS: 6, _QUATERNIONS: 4}
_ORDERS = {"_wxyz": (1, 2, 3, 0), "_xyzw": (0, 1, 2, 3)}  # where x, y, z and w of a quaternion are
_ORTHONORMAL = 1e-3  # how far rounded rotation matrices are off
_NEARLY = 0.2  # so near to orthonormal are three frames of rotation vectors by no chance

Array = NDArray[Any]


def pieces_of() -> dict[str, list[Joints]]:
    """The arrays that hold a piece of the pose, in files of all kinds of models, and the joints that each may have."""
    pieces: dict[str, list[Joints]] = {}
    for format in FORMATS.values():
        for name, sets in format.pieces.items():
            pieces[name] = list(dict.fromkeys((*pieces.get(name, ()), *sets)))
    return pieces


def names() -> set[str]:
    """Of all arrays that hold a pose or a piece of it."""
    endings = ("", *_ORDERS, *(f"_quat{end}" for end in _ORDERS))
    return {f"{name}{more}" for name in (*WHOLE_POSES, *pieces_of()) for more in endings}


def _whole() -> list[Joints]:
    return list(dict.fromkeys(joints for format in FORMATS.values() for joints in format.poses))


@dataclass(frozen=True, eq=False)
class Piece:
    """Rotation vectors (T, n, 3) of the joints (n,) of these names.

    name: of the array in its file. form: what the array holds. Fingers that are no rotation vectors in the file are
    absolute, not relative to a mean hand (`Hands`).
    """

    rotations: Array
    joints: tuple[str, ...]
    name: str = ""
    form: str = _VECTORS

    @property
    def is_absolute(self) -> bool:
        return self.form != _VECTORS


def read(first: Callable[..., Array | None], degrees: bool = False, kind: str | None = None) -> list[Piece]:
    """The pieces of a stored pose; `first(*names)` gives the first of these arrays that there is, or None.

    degrees: of rotation vectors; in the pieces they are radians. kind: of the model that the pose is of, one of
    `formats.FORMATS`; None: not known, and then the joints are those of the only kind that has so many.

    Raises:
        ValueError: an array has another shape than its joints need, does not tell what it holds, may be the joints of
            several kinds of models, or pieces have unequal numbers of frames.
    """
    pieces = _pieces(first, FORMATS.get(kind or ""))
    if degrees:
        pieces = [each if each.is_absolute else replace(each, rotations=np.radians(each.rotations)) for each in pieces]
    counts = {len(piece.rotations) for piece in pieces}
    if len(counts - {1}) > 1:
        raise ValueError(f"pose arrays have {sorted(counts)} frames; expected equal numbers")
    turn = next((piece for piece in pieces if piece.name == "Rh"), None)
    return pieces if turn is None else _turned(turn, [piece for piece in pieces if piece is not turn])


def _pieces(first: Callable[..., Array | None], kind: BodyFormat | None) -> list[Piece]:
    """As they are in the file."""
    for name in WHOLE_POSES:
        whole = _stored(first, name)
        if whole is not None:
            turn = first("Rh")
            choices = _whole() if kind is None else of_kind(_whole(), kind.poses)
            if turn is None:
                return [_piece(*whole, choices)]
            rest = [joints[1:] for joints in SMPL.poses]
            return [_piece("Rh", turn, pieces_of()["Rh"]), _piece(*whole, (*choices, *rest))]
    stored: list[tuple[str, Array, list[Joints]]] = []
    for base, sets in pieces_of().items():
        choices = sets if kind is None else of_kind(sets, kind.pieces.get(base, ()))
        stored += [(name, array, choices) for name, array in _listed(_stored(first, base))]
    # One matrix has the shape of three rotation vectors: how many frames the others have tells which it is.
    others = [_piece(*one) for one in stored if one[1].shape != (3, 3)]
    frames = {len(piece.rotations) for piece in others} - {1}
    made = {piece.name: piece for piece in others}
    return [made.get(name) or _square(name, array, joints, frames) for name, array, joints in stored]


def _turned(turn: Piece, pieces: list[Piece]) -> list[Piece]:
    """With the root turned after it has turned by itself."""
    from scipy.spatial.transform import Rotation

    root = next((piece for piece in pieces if piece.joints[0] == BODY[0]), None)
    if root is None:
        return [turn, *pieces]
    ways = np.broadcast_arrays(turn.rotations[:, 0], root.rotations[:, 0])
    whole = np.broadcast_to(root.rotations, (len(ways[0]), *root.rotations.shape[1:])).astype(np.float64)
    outer, inner = (Rotation.from_rotvec(np.nan_to_num(way)) for way in ways)
    whole[:, 0] = np.where(np.isfinite(ways[0] + ways[1]), (outer * inner).as_rotvec(), np.nan)
    return [replace(piece, rotations=whole) if piece is root else piece for piece in pieces]


def place(
    pieces: Sequence[Piece],
    joint_names: Sequence[str],
    length: int,
    pose_mean: Array | None = None,
    dtype: type[np.floating] = np.float64,
) -> NDArray[Any]:
    """The pose (length, J, 3) on joints of these names, zero where no piece turns them; a piece of one frame is that of
    all. `pose_mean` (J, 3), `BodyModel.pose_mean`: is taken off absolute rotations."""
    pose = np.zeros((length, len(joint_names), 3), dtype)
    for piece in pieces:
        here = [k for k, name in enumerate(piece.joints) if name in joint_names]
        columns = [joint_names.index(piece.joints[k]) for k in here]
        pose[:, columns] = piece.rotations[:, here]
        if piece.is_absolute and pose_mean is not None:
            pose[:, columns] -= pose_mean[columns]
    return pose


def joints_of(body: BodyModel) -> dict[str, list[int]]:
    """The joints of each piece that a body has, under the names by which its kind writes the pieces; for bodies of no
    kind in `formats.FORMATS` those of the smplx package."""
    column = {name: index for index, name in enumerate(body.joint_names)}
    own = FORMATS.get(body.kind)
    listed = pieces_of() if own is None else {"pose": own.poses, **own.pieces}
    pieces = {name: [p for p in listed.get(name, ()) if set(p) <= set(column)] for name in (own or SMPLX).written}
    return {name: [column[joint] for joint in max(each, key=len)] for name, each in pieces.items() if each}


def split(pose: Array, body: BodyModel) -> dict[str, Array]:
    """Poses (T, J, 3) of a body as the arrays of its pieces (T, 3 n), named by `joints_of`; `joined` reads them."""
    return {name: pose[:, joints].reshape(len(pose), -1) for name, joints in joints_of(body).items()}


def joined(arrays: Mapping[str, Array], body: BodyModel, prefix: str = "") -> NDArray[np.float64]:
    """The pose (J, 3) in arrays that `split` made of one; `prefix`: of their names.

    Raises:
        ValueError: an array is missing, or has another size than the body's joints need.
    """
    pose = np.zeros((body.num_joints, 3))
    for name, joints in joints_of(body).items():
        if f"{prefix}{name}" not in arrays or arrays[f"{prefix}{name}"].size != 3 * len(joints):
            raise ValueError(f"{prefix}{name}: expected {3 * len(joints)} numbers for the body {body.name}")
        pose[joints] = arrays[f"{prefix}{name}"].reshape(-1, 3)
    return pose


def _stored(first: Callable[..., Array | None], base: str) -> tuple[str, Array] | None:
    """The array of a pose, or a piece, under its plain name or that of quaternions."""
    for name in (base, *(f"{base}{more}{order}" for order in _ORDERS for more in ("", "_quat"))):
        array = first(name)
        if array is not None:
            return name, array
    return None


def _listed(named: tuple[str, Array] | None) -> list[tuple[str, Array]]:
    return [] if named is None else [named]


def _piece(name: str, array: Array, choices: Sequence[Joints]) -> Piece:
    """The rotations of an array by its shape; those of the first of the `choices` of joints that it fits."""
    order = next((order for ending, order in _ORDERS.items() if name.endswith(ending)), None)
    for joints in choices:
        for form, width in _WIDTHS.items():
            rows = _rows(array, len(joints), width)
            if rows is None or (form == _QUATERNIONS) != (order is not None):
                continue
            _check_only(name, array, joints, choices)
            return Piece(_vectors(name, form, rows, order), joints, name, form)
    for joints in choices:
        if order is None and _rows(array, len(joints), 4) is not None:
            raise ValueError(
                f"{name} has shape {array.shape}, as of quaternions, and nothing tells whether w is first or last: "
                f"call the array {name}_wxyz or {name}_xyzw"
            )
    widths = " or ".join(str(3 * len(joints)) for joints in choices)
    raise ValueError(
        f"{name} has shape {array.shape}; expected rotation vectors (T, {widths}), or matrices (T, n, 3, 3) of "
        f"{' or '.join(str(len(joints)) for joints in choices)} joints"
    )


def _check_only(name: str, array: Array, joints: Joints, choices: Sequence[Joints]) -> None:
    """ValueError if other joints are as many."""
    equal = [other for other in choices if len(other) == len(joints)]
    if len(equal) == 1:
        return
    sets = {format.title: {*format.poses, *sum(format.pieces.values(), ())} for format in FORMATS.values()}
    titles = [next(title for title, own in sets.items() if other in own) for other in equal]
    raise ValueError(
        f"{name} has shape {array.shape}, as poses of {' and '.join(titles)} have, and nothing tells of which model it "
        f"is: name it in an array model, as one of {', '.join(FORMATS)}"
    )


def _square(name: str, array: Array, choices: Sequence[Joints], frames: set[int]) -> Piece:
    """An array (3, 3): one matrix, if it is a rotation and the other pieces have not three `frames`, else vectors."""
    single = [joints for joints in choices if len(joints) == 1]
    if not single or not _are_rotations(array[None]):
        off = _off_orthonormal(array[None])
        if single and 3 not in frames and off < _NEARLY:
            raise ValueError(
                f"{name} has shape (3, 3) and is nearly a rotation matrix, off by {off:.2g}: is it one? Save it "
                "exactly, or as a rotation vector (1, 3)"
            )
        return _piece(name, array, choices)
    if 3 in frames:
        raise ValueError(
            f"{name} has shape (3, 3): it may be one rotation matrix or three frames of rotation vectors; save it as "
            "(1, 3, 3) or as (3, 1, 3)"
        )
    return _piece(name, array[None], choices)


def _rows(array: Array, joints: int, width: int) -> Array | None:
    """The array as (T, joints, width), if its shape is that of so many joints with so many numbers each."""
    tails: list[tuple[int, ...]] = [(joints * width,), (joints, width)]
    if width == 9:
        tails = [(joints, 3, 3), *([(3, 3)] if joints == 1 else []), *tails]
    if width == 6:
        tails.append((joints, 3, 2))
    for tail in tails:
        lead = array.shape[: array.ndim - len(tail)]
        if array.ndim >= len(tail) and array.shape[array.ndim - len(tail) :] == tail and array.size:
            if joints == 1 and width == 3 and array.ndim > 2 and tail == (3,) and array.shape[-2] == 3:
                continue  # (T, 3, 3): matrices
            if sum(size != 1 for size in lead) <= 1:
                return array.reshape(math.prod(lead), joints, width)
    return None


def _vectors(name: str, form: str, rows: Array, order: tuple[int, ...] | None) -> Array:
    """Rotation vectors (T, n, 3) of rows in one of the forms."""
    if form == _VECTORS:
        return rows
    from scipy.spatial.transform import Rotation

    rows = rows.astype(np.float64)
    known = np.asarray(np.isfinite(rows).all(axis=-1))
    rows = np.where(known[..., None], rows, _IDENTITY[form] if order is None else np.eye(4)[order[3]])
    if order is not None:
        lengths = np.linalg.norm(rows, axis=-1)
        if (np.abs(lengths - 1) > 0.1).any():
            raise ValueError(f"{name}: expected quaternions of length 1, got one of {lengths.flat[0]:.4g}")
        turned = Rotation.from_quat(rows[..., order].reshape(-1, 4))
    else:
        matrices = rows.reshape(-1, 3, 3) if form == _MATRICES else _from_columns(name, rows.reshape(-1, 6))
        if not _are_rotations(matrices):
            raise ValueError(f"{name}: has the shape of rotation matrices, but they are none; save rotation vectors")
        turned = Rotation.from_matrix(matrices)
    vectors = turned.as_rotvec().reshape(*rows.shape[:-1], 3)
    vectors[~known] = np.nan
    return vectors


_IDENTITY = {_MATRICES: np.eye(3).ravel(), COLUMNS: np.eye(3)[:2].ravel()}


def _from_columns(name: str, rows: Array) -> Array:
    """Matrices (n, 3, 3) of two columns, one after the other, or in turn as SPIN writes them (n, 3, 2)."""
    after = rows.reshape(-1, 2, 3)
    in_turn = rows.reshape(-1, 3, 2).swapaxes(1, 2)
    for columns in (after, in_turn):
        if np.abs(columns @ columns.swapaxes(1, 2) - np.eye(2)).max() < _ORTHONORMAL:
            return rotations.from_6d(np.ascontiguousarray(columns).reshape(-1, 6))
    raise ValueError(
        f"{name}: has six numbers for each joint, but they are no two columns of a rotation matrix; save rotation "
        "vectors or matrices"
    )


def _are_rotations(matrices: Array) -> bool:
    matrices = matrices.astype(np.float64)
    return bool(_off_orthonormal(matrices) < _ORTHONORMAL and np.all(np.linalg.det(matrices) > 0))


def _off_orthonormal(matrices: Array) -> float:
    """By how much M Mᵀ of matrices (n, 3, 3) is off the identity at most."""
    matrices = matrices.astype(np.float64)
    return float(np.abs(np.matmul(matrices, matrices.swapaxes(-1, -2)) - np.eye(3)).max(initial=0))
