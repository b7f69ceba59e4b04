"""Files of presented poses (.npz, .pkl): one body's pose, and its floor and contact where they are known.

Poses are named as `body.pose_arrays` has them; beside them there may be

    betas (n,), transl or trans (3,)      shape, and place in the file's world
    ground (4,) or (T, 4)                 the normal and the height of its floor; or ground_height, with ground_normal
    contact                               the vertices that touch: indices, pairs of them, or a flag for each vertex
    model, body                           what the parameters are of, where the joints do not say

Ground and contact belong to one body model: they count if that is the one which is fitted. Nothing in a file is
executed.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from ipman_rs.body import BodyModel, embedded, formats, joints, pose_arrays
from ipman_rs.files import read_json, regular_file, safe_npz, safe_pickle
from ipman_rs.ground import Ground

Array = NDArray[Any]
Axis = tuple[float, float, float]

ENDINGS = (".npz", ".pkl")
LARGEST_ANGLE = 4 * np.pi  # a turn and more in a rotation vector are degrees
FARTHEST = 10.0  # m, of a pelvis above or below its floor
_Z_UP = ("poses", "fullpose", "root_orient")  # arrays of AMASS and MoYo, whose worlds have z up
_ABSOLUTE = ("poses", "fullpose", "pose_hand", "full_pose")  # whose fingers are not relative to the mean hand
_KINDS = ("model", "body", "model_type")
_HANDS = {"left_hand_pose": joints.LEFT_HAND, "right_hand_pose": joints.RIGHT_HAND}


@dataclass(frozen=True, eq=False)
class StoredPose:
    """A pose of a file on the joints of a body.

    pose (J, 3): rotation vectors, the root first, in a world with y up. height: m, of the floor in that world, whose
    origin is where the body's parameters have theirs. contact (n,): the vertices that touch. None: not known.
    """

    pose: NDArray[np.float64]
    height: float | None
    contact: NDArray[np.int64] | None
    notes: tuple[str, ...]


def read(path: Path, body: BodyModel, frame: int | None = None, up: Axis | None = None) -> StoredPose:
    """The pose of a file for a body model; `frame`, `up` as in `presented.load`.

    Raises:
        ValueError: the file is missing, damaged, has several poses and no frame is named, or numbers that cannot be
            radians and metres.
    """
    stored = _Stored.open(path)
    pieces = _hands_turned(stored, body)
    if not pieces:
        listed = safe_npz.list_arrays(stored.names)
        raise ValueError(
            f"{stored.path}: holds {listed}; expected a pose such as global_orient with body_pose, or pose"
        )
    length = max(len(piece.rotations) for piece in pieces)
    row = _row(stored, length, frame)
    own_mean = None if stored.is_absolute else body.pose_mean
    pose = pose_arrays.place(pieces, body.joint_names, length, own_mean)[row]
    _check_angles(stored, pose)
    if stored.is_absolute:
        pose = pose - body.pose_mean
    notes: list[str] = []
    own = _kind(stored, pieces) == body.kind
    if not own and stored.names & {"ground", "ground_height", "contact"}:
        notes.append(f"{stored.path}: is of another body than {body.name}: its floor and contact are not used")
    normal, height = _ground(stored, row) if own else (None, None)
    if normal is not None and up is not None:
        notes.append(f"{stored.path}: has a ground, whose normal is up: `pose_up` is not needed")
    if normal is None and stored.names >= {"names", "body"} and up is None:
        raise ValueError(
            f"{stored.path}: predictions for a data set, whose axes are its own, without a ground: say what points up "
            "(`pose_up`)"
        )
    turn = y_up(np.array(up or stored.up) if normal is None else normal)
    pose[0] = (turn * Rotation.from_rotvec(pose[0])).as_rotvec()
    if height is not None and normal is not None:
        height = _above_floor(stored, body, row, normal, height)
    contact = None
    if own and "contact" in stored.names:
        contact = _indices(stored.first("contact"), f"{stored.path}: contact", body)
    return StoredPose(pose, height, contact, tuple(notes))


def read_contact(path: Path, body: BodyModel) -> NDArray[np.int64]:
    """The vertices of a contact file: a list in .json, or `contact` in .npz or .pkl. Raises ValueError."""
    if path.suffix.lower() not in (*ENDINGS, ".json"):
        raise ValueError(f"{path}: expected contact in .json, .npz or .pkl, got {path.suffix or 'no ending'}")
    if path.suffix.lower() in ENDINGS:
        stored = _Stored.open(path)
        contact = stored.first("contact")
        if contact is None:
            raise ValueError(f"{path}: expected an array contact, it has {safe_npz.list_arrays(stored.names)}")
        return _indices(contact, f"{path}: contact", body)
    content = read_json(path)
    try:
        contact = np.array(content["contact"] if isinstance(content, dict) else content)
    except (ValueError, KeyError) as error:
        raise ValueError(f"{path}: expected a list of vertices (.json), or contact in .npz or .pkl: {error}") from None
    return _indices(contact, f"{path}: contact", body)


def y_up(normal: Array) -> Rotation:
    """The smallest turn that brings a direction (3,) to y."""
    normal = np.asarray(normal, float) / np.linalg.norm(normal)
    axis, cosine = np.cross(normal, [0.0, 1.0, 0.0]), float(normal[1])
    sine = float(np.linalg.norm(axis))
    if sine == 0.0:
        return Rotation.from_rotvec([0.0, 0.0, 0.0 if cosine > 0 else np.pi])
    return Rotation.from_rotvec(axis / sine * np.arctan2(sine, cosine))


class _Stored:
    """The numbers of a file by name; nothing in it is executed."""

    def __init__(self, path: Path, names: set[str], read: Callable[[str], Any]) -> None:
        self.path, self.names, self._read = path, names, read

    @classmethod
    def open(cls, path: Path) -> _Stored:
        regular_file(path)
        if path.suffix.lower() == ".npz":
            return cls(path, safe_npz.names(path), lambda name: safe_npz.read(path, name))
        content = safe_pickle.read(path, "presented pose", "a pose of SMPL, SMPL-X or MoYo", tolerant=True)
        names = {name for name in content if isinstance(name, str)}
        return cls(path, names, lambda name: _plain(content[name], f"{path}: {name}"))

    @property
    def up(self) -> Axis:
        """Of the world of files with these arrays."""
        return (0.0, 0.0, 1.0) if self.names & {*_Z_UP} else (0.0, 1.0, 0.0)

    @property
    def is_absolute(self) -> bool:
        """Whether fingers are rotations, not relative to the mean hand: AMASS's, MoYo's, and predictions'."""
        return bool(self.names & {*_ABSOLUTE}) or self.names >= {"names", "body", "pose"}

    def first(self, *names: str) -> Array | None:
        """The first of these that is there, as numbers."""
        for name in names:
            if name in self.names:
                array = np.asarray(self._read(name))
                if array.dtype.kind == "O" and array.shape == () and array[()] is None:
                    continue
                if array.dtype.kind not in "fiub":
                    raise ValueError(f"{self.path}: {name} holds {array.dtype}, not numbers; save plain numbers")
                return array
        return None

    def word(self, *names: str) -> str | None:
        for name in names:
            if name in self.names:
                return str(self._read(name))
        return None


def _plain(value: Any, place: str) -> Any:
    if value is None or isinstance(value, (str, int, float, bool)):
        return value
    if isinstance(value, (list, tuple)):
        try:
            return np.array(value)
        except ValueError as error:
            raise ValueError(f"{place}: {error}") from None
    try:
        return safe_pickle.as_array(value)
    except ValueError:
        raise ValueError(f"{place}: expected numbers, got another kind of object; save it as a numpy array") from None


def _hands_turned(stored: _Stored, body: BodyModel) -> list[pose_arrays.Piece]:
    """The pieces of a file's pose. Hands that are weights of principal components (12 in upstream's and RICH's)
    become rotations of the fingers, or are left out where the body has no components."""
    weights = {name: stored.first(name) for name in _HANDS}
    weights = {name: each for name, each in weights.items() if each is not None and _are_weights(each)}
    try:
        pieces = pose_arrays.read(
            lambda *names: None if names[0] in weights else stored.first(*names),
            kind=formats.kind_named(stored.word(*_KINDS)) or body.kind,
        )
    except ValueError as error:
        raise ValueError(f"{stored.path}: {error}") from None
    if body.hands is None:
        return pieces
    for side, (name, fingers) in enumerate(_HANDS.items()):
        if name in weights:
            rows = weights[name].reshape(-1, weights[name].shape[-1])
            try:
                turned = body.hands.from_components(rows, rows)[:, 15 * side : 15 * side + 15]
            except ValueError as error:
                raise ValueError(f"{stored.path}: {name}: {error}") from None
            pieces.append(pose_arrays.Piece(turned, fingers))
    return pieces


def _are_weights(hand: Array) -> bool:
    return hand.ndim > 0 and hand.shape[-1] not in (3, 45)


def _check_angles(stored: _Stored, pose: Array) -> None:
    """ValueError for what are no rotation vectors in radians."""
    if not np.isfinite(pose).all():
        raise ValueError(f"{stored.path}: the pose is not finite")
    largest = float(np.linalg.norm(np.clip(pose, -1e100, 1e100), axis=-1).max())  # whose squares are finite
    if largest > LARGEST_ANGLE:
        raise ValueError(
            f"{stored.path}: the pose looks like degrees: a joint turns by {largest:.4g}; expected rotation vectors in "
            "radians"
        )


def _row(stored: _Stored, length: int, frame: int | None) -> int:
    if frame is None and length > 1:
        raise ValueError(f"{stored.path}: holds {length} poses; say which is presented (`pose_frame`, from 0)")
    if not 0 <= (frame or 0) < length:
        raise ValueError(f"{stored.path}: frame: expected 0 to {length - 1}, got {frame}")
    return frame or 0


def _kind(stored: _Stored, pieces: Sequence[pose_arrays.Piece]) -> str:
    """What the parameters are of: what the file says, or what its joints tell."""
    named = stored.word(*_KINDS)
    if named is not None and named.lower() in (*embedded.NAMES, *formats.FORMATS):
        return named.lower()
    own = next((name for name, each in formats.FORMATS.items() if pieces[0].joints == each.joints), None)
    if own is not None:
        return own
    turned = {name for piece in pieces for name in piece.joints}
    if "left_hand" in turned:
        return "smpl"
    whole = stored.names & {*pose_arrays.WHOLE_POSES}  # AMASS's SMPL+H; pieces without a jaw may be SMPL-X, too
    return "smplh" if whole and "left_index1" in turned and "jaw" not in turned else "smplx"


def _ground(stored: _Stored, row: int) -> tuple[Array | None, float | None]:
    """Normal and height of the file's floor, or neither."""
    plane = stored.first("ground")
    if plane is None and "ground_height" in stored.names:
        height = stored.first("ground_height")
        normal = stored.first("ground_normal")
        normal = np.array(stored.up) if normal is None else normal.reshape(-1, 3)[0]
        plane = None if height is None else np.append(normal, np.ravel(height)[:1])
    if plane is None:
        return None, None
    if plane.shape[-1:] != (4,) or plane.ndim > 2 or (plane.ndim == 2 and 1 < len(plane) <= row):
        raise ValueError(f"{stored.path}: ground: expected a normal and a height (4,), or (T, 4), got {plane.shape}")
    rows = plane.reshape(-1, 4).astype(float)
    plane = rows[row if len(rows) > 1 else 0]
    if not np.isfinite(plane).all() or not plane[:3].any():
        raise ValueError(f"{stored.path}: ground: expected a finite normal that is not 0, and a height, got {plane}")
    ground = Ground(plane[:3], plane[3])
    return np.asarray(ground.normal, float), float(ground.height)


def _above_floor(stored: _Stored, body: BodyModel, row: int, normal: Array, height: float) -> float:
    """Height of the file's floor in the fit's world, m: the root joint stands as high above it as in the file."""
    above = float(normal @ _place(stored, body, row)) - height
    if not -FARTHEST < above < FARTHEST:
        raise ValueError(
            f"{stored.path}: the pelvis is {above:.4g} m above the file's ground; are transl and ground in metres?"
        )
    return float(_pelvis(body)[1]) - above


def _place(stored: _Stored, body: BodyModel, row: int) -> Array:
    """Where the pelvis is in the file's world (3,) m."""
    transl, betas = stored.first("transl", "trans"), stored.first("betas")
    if betas is not None and (betas.ndim == 0 or betas.size == 0 or not np.isfinite(betas).all()):
        raise ValueError(f"{stored.path}: betas: expected finite numbers (n,) or (T, n), got shape {betas.shape}")
    pelvis = _pelvis(body, None if betas is None else betas.reshape(-1, betas.shape[-1]), row)
    if transl is None:
        return pelvis
    if transl.shape[-1:] != (3,) or transl.size == 0 or not np.isfinite(transl).all():
        raise ValueError(f"{stored.path}: transl: expected finite metres (3,) or (T, 3), got shape {transl.shape}")
    rows = transl.reshape(-1, 3).astype(float)
    return pelvis + rows[row if len(rows) > row else 0]


def _pelvis(body: BodyModel, betas: Array | None = None, row: int = 0) -> Array:
    """The root joint (3,) m, about which a body turns, of the mean shape or of betas (n or 1, b)."""
    if betas is None:
        return body.J_template[0]
    count = min(betas.shape[1], body.num_betas)
    return body.J_template[0] + body.J_shapedirs[0, :, :count] @ betas[row if len(betas) > row else 0, :count]


def _indices(contact: Array | None, place: str, body: BodyModel) -> NDArray[np.int64]:
    """Vertices as ascending indices, from indices, pairs of them, or a flag for each vertex."""
    if contact is None or contact.size == 0:
        return np.zeros(0, np.int64)
    count = body.num_vertices
    values: Array = contact[0] if contact.shape == (1, count) else contact  # a flag for each vertex of a batch of one
    if values.dtype.kind == "b" or (values.shape == (count,) and np.isin(values, (0, 1)).all()):
        if values.shape != (count,):
            raise ValueError(f"{place}: expected a flag for each of {count} vertices, got shape {values.shape}")
        return np.flatnonzero(values)
    if values.dtype.kind not in "iuf" or not np.isfinite(values).all() or not np.equal(values, np.round(values)).all():
        raise ValueError(f"{place}: expected indices of vertices, whole numbers")
    vertices = np.unique(values)
    if vertices[0] < 0 or vertices[-1] >= count:
        raise ValueError(
            f"{place}: expected vertices 0 to {count - 1} of {body.name}, got {vertices[0]:g} to {vertices[-1]:g}"
        )
    return vertices.astype(np.int64)
