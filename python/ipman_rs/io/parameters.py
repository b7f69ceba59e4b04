"""Read .npz files: vertices with faces, or the parameters of a body model, one body or a sequence."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from ..body import pose_arrays, rotations
from ..body.joints import LEFT_HAND, RIGHT_HAND
from ..body.sequence import Index, PosedSequence, rows_of
from ..data import check, plausibility
from ..data.check import Finding
from ..files import safe_npz
from ..files.errors import FileError
from ..files.mesh import repair
from .body_sequence import Y_UP, Z_UP, BodySequence
from .parts import match_body
from .stored_arrays import StoredArrays

_EXPECTED = (
    "expected vertices and faces, or poses/betas/trans (AMASS), or global_orient/body_pose/betas/transl, or "
    "pose/betas/transl"
)
_VERTICES = ("vertices", "verts", "v")
_BETAS = ("betas", "shape", "shapes", "smpl_betas")
_TRANSLATIONS = ("trans", "transl", "Th", "smpl_trans", "cam_trans")
_FRAME_RATES = ("mocap_framerate", "mocap_frame_rate", "fps", "frame_rate", "framerate")
_MODEL_BETAS = 10  # that a model file is asked for at least


def read_npz(
    path: Path,
    model: str | None,
    *,
    unit: float = 1.0,
    degrees: bool = False,
    rate: float | None = None,
    arrays: Mapping[str, np.ndarray] | None = None,
) -> BodySequence:
    """The bodies of an .npz file; `model` None: of the body that the file names, or anny. Raises FileError.

    unit: metres in one of the file's lengths. degrees: rotation vectors are degrees. rate: Hz, instead of the file's.
    arrays: what the file holds, by a caller that has just written it.
    """
    try:
        stored = StoredArrays(path, arrays)
        model = model or stored.model()
        has_pose = bool(stored.names & pose_arrays.names())
        if stored.names & {*_VERTICES} and not (has_pose and _are_of_another_body(stored, model)):
            sequence = _read_vertices(stored, model, unit, rate)
        elif has_pose:
            sequence = _read_parameters(stored, model, unit, degrees, rate)
        else:
            raise FileError(path, _no_bodies(stored))
    except ValueError as error:
        raise FileError(path, str(error)) from error
    return replace(sequence, unused=stored.unused())


def _no_bodies(stored: StoredArrays) -> str:
    """What is there instead."""
    for name in sorted(stored.names):
        try:
            stored.shape_of(name)
        except ValueError as error:
            if "Python objects" in str(error):
                return f"{name} holds Python objects, which are not loaded; save what is in it as plain arrays"
    return f"holds {safe_npz.list_arrays(stored.names)}; {_EXPECTED}"


def _are_of_another_body(stored: StoredArrays, model: str) -> bool:
    """Whether vertices come without faces, and are not those of the model: then the pose beside them is read."""
    import ipman_rs as ip

    if stored.names & {"faces", "f"}:
        return False
    shape = stored.shape_of(str(stored.name(*_VERTICES)))
    return len(shape) < 2 or shape[-2] != ip.load_body(model).num_vertices


def _read_vertices(stored: StoredArrays, model: str, unit: float, rate: float | None) -> BodySequence:
    import ipman_rs as ip

    vertices, faces = stored.first(*_VERTICES), stored.first("faces", "f")
    if vertices is None or vertices.ndim not in (2, 3) or vertices.shape[-1] != 3 or 0 in vertices.shape:
        raise FileError(stored.path, f"vertices have shape {getattr(vertices, 'shape', 0)}, not (V, 3) or (T, V, 3)")
    vertices = vertices.reshape(-1, *vertices.shape[-2:])
    if unit != 1.0:
        vertices = vertices * unit
    if faces is None:
        body = ip.load_body(model)
        if body.num_vertices != vertices.shape[1]:
            what = f"has {vertices.shape[1]} vertices and no faces, but the body {body.name} has {body.num_vertices}"
            raise FileError(stored.path, f"{what}; add faces, or name the body with `model`")
        faces = body.faces
    if faces.ndim != 2 or faces.shape[1] != 3 or len(faces) == 0 or faces.dtype.kind not in "iu":
        raise FileError(stored.path, f"faces are {faces.dtype} {faces.shape}; expected whole numbers (F, 3)")
    faces = faces.astype(np.int64)
    if faces.min() < 0 or faces.max() >= vertices.shape[1]:
        count, bad = vertices.shape[1], int(faces.min() if faces.min() < 0 else faces.max())
        one = "; do they count from 1?" if faces.min() > 0 and bad == count else ""
        raise FileError(
            stored.path, f"faces name vertex {bad}, but there are {count} vertices, counted from 0 to {count - 1}{one}"
        )
    mesh = repair.Mesh(vertices[0], faces)
    if match_body(faces, vertices.shape[1], model) is None:
        mesh = repair.drop_unused_vertices(repair.weld(mesh) if len(vertices) == 1 else mesh)
    if len(vertices) == 1:
        vertices = mesh.vertices[None]
    elif mesh.vertex_map is not None:
        vertices = vertices[:, mesh.vertex_map >= 0]
    seconds, findings = _seconds(stored, len(vertices), rate)
    return BodySequence(
        stored.path, vertices, mesh.faces, vertex_map=mesh.vertex_map, face_map=mesh.face_map, seconds=seconds,
        up=Y_UP, notes=mesh.notes, findings=tuple(findings),
    )  # fmt: skip


def _read_parameters(stored: StoredArrays, model: str, unit: float, degrees: bool, rate: float | None) -> BodySequence:
    easymocap = "Rh" in stored.names
    amass = not easymocap and bool(stored.names & {"poses", "root_orient"})
    body = _body(stored, model, amass)
    pieces = pose_arrays.read(stored.first, degrees, stored.kind() or body.kind)
    pose = _Pose(pieces, body)
    trans = _translations(stored, len(pose), unit)
    betas, shape = _betas(stored, body, len(pose), amass or easymocap)
    expression, face = _expression(stored, body, len(pose))
    seconds, findings = _seconds(stored, len(pose), rate)
    findings = [
        *_columns(pieces),
        *_angles(pieces, degrees),
        *_places(stored, trans, seconds),
        *findings,
        *_gender(stored, body, model),
    ]
    if easymocap:
        trans = _about_the_origin(stored, body, betas, trans, degrees)
    _pass_over_repeated(stored, pieces)

    def parameters(index: Index) -> tuple[np.ndarray | None, ...]:
        return pose.of(index), *(_singles(rows, index) for rows in (betas, trans, expression))

    vertices = PosedSequence(body, len(pose), parameters)
    note = f"body: {body.name}, posed by {len(pose.names)} joints of the file"
    return BodySequence(
        stored.path, vertices[:].astype(np.float64) if len(pose) == 1 else vertices, body.faces, body.template,
        seconds=seconds, up=Z_UP if amass else Y_UP, up_why=", as AMASS has it" if amass else "",
        notes=(note, *pose.notes(), *shape, *face), findings=tuple(findings),
    )  # fmt: skip


def _body(stored: StoredArrays, model: str, amass: bool) -> Any:
    """The body model, with as many betas as the file has, if it has so many."""
    import ipman_rs as ip

    name = stored.name(*_BETAS)
    width = () if name is None else stored.shape_of(name)[-1:]
    # AMASS stores absolute hand angles, the smplx package angles relative to the mean hand.
    return ip.load_body(model, num_betas=max((_MODEL_BETAS, *width)), flat_hand_mean=amass)


def _translations(stored: StoredArrays, frames: int, unit: float) -> np.ndarray | None:
    """Rows (1 or T, 3) m."""
    name = stored.name(*_TRANSLATIONS)
    trans = stored.first(*_TRANSLATIONS)
    if trans is None:
        return None
    if trans.shape[-1:] != (3,) or trans.reshape(-1, 3).shape[0] not in (1, frames):
        raise FileError(stored.path, f"{name} has shape {trans.shape}; expected ({frames}, 3)")
    return trans.reshape(-1, 3) if unit == 1.0 else trans.reshape(-1, 3) * unit


def _about_the_origin(
    stored: StoredArrays, body: Any, betas: np.ndarray | None, trans: np.ndarray | None, degrees: bool
) -> np.ndarray:
    """EasyMocap turns the posed body about the origin of its world, and SMPL about the pelvis p.

    R (x − p) + p + t is R x + Th for t = Th + (R − 1) p.
    """
    turn = np.asarray(stored.first("Rh"), np.float64).reshape(-1, 3)
    pelvis = body.J_template[0] + (0.0 if betas is None else betas @ body.J_shapedirs[0, :, : betas.shape[1]].T)
    pelvis = np.reshape(pelvis, (-1, 3))
    matrices = rotations.from_axis_angle(np.radians(turn) if degrees else turn)
    turned = (matrices @ pelvis[..., None])[..., 0]
    return (0.0 if trans is None else trans) + turned - pelvis


def _singles(rows: np.ndarray | None, index: Index) -> np.ndarray | None:
    return None if rows is None else rows_of(rows, index).astype(np.float32)


class _Pose:
    """The poses of a file, put on the joints that a body has when they are asked for."""

    def __init__(self, pieces: list[pose_arrays.Piece], body: Any) -> None:
        self._pieces, self._body = pieces, body
        self._length = max(len(piece.rotations) for piece in pieces)
        self.names = tuple(name for piece in pieces for name in piece.joints)

    def __len__(self) -> int:
        return self._length

    def of(self, index: Index) -> np.ndarray:
        """(n, J, 3) float32."""
        chosen = [replace(piece, rotations=rows_of(piece.rotations, index)) for piece in self._pieces]
        count = np.zeros(self._length, dtype=bool)[index].size
        return pose_arrays.place(chosen, self._body.joint_names, count, self._body.pose_mean, np.float32)

    def notes(self) -> list[str]:
        """What rotations are, where they are no vectors, and what was left out."""
        notes = [f"{piece.name}: {piece.form}" for piece in self._pieces if piece.is_absolute]
        left_out = [name for name in self.names if name not in self._body.joint_names]
        if left_out:
            missing = f"for the body {self._body.name} has no {_kind(left_out)}"
            notes.append(f"pose: {len(left_out)} joints are left out, {missing}")
        return notes


def _kind(joints: list[str]) -> str:
    fingers = [name for name in joints if name in LEFT_HAND or name in RIGHT_HAND]
    others = [name.replace("_", " ") for name in joints if name not in fingers]
    return " or ".join((["fingers"] if fingers else []) + others)


def _betas(stored: StoredArrays, body: Any, frames: int, of_smpl: bool) -> tuple[np.ndarray | None, list[str]]:
    """The shape, rows (1 or T, B), and what of it was used."""
    import ipman_rs as ip

    betas = stored.first(*_BETAS)
    if betas is None:
        return None, ["shape: the body's mean (the file has no betas)"]
    name = str(stored.name(*_BETAS))
    embedded = body.name in ip.body.embedded.NAMES
    if embedded and (of_smpl or name == "smpl_betas"):
        return None, [f"shape: the mean of {body.name} (the file's betas belong to SMPL; `model=FILE` uses them)"]
    rows = _rows(stored, name, betas, frames)
    used = min(rows.shape[1], body.num_betas)
    if used < rows.shape[1]:
        note = f"shape: the first {used} of {rows.shape[1]} betas, as many as {body.name} has"
    else:
        note = f"shape: the file's {used} betas"
    return rows[:, :used], [f"{note}, taken as those of {body.name}" if embedded else note]


def _expression(stored: StoredArrays, body: Any, frames: int) -> tuple[np.ndarray | None, list[str]]:
    """The face's expression, rows (1 or T, E), and what of it was left out."""
    given = stored.first("expression")
    if given is None or not given.any():
        return None, []
    rows = _rows(stored, "expression", given, frames)
    used = min(rows.shape[1], body.num_expressions)
    if not used:
        return None, [f"expression: left out, for the body {body.name} has none"]
    return rows[:, :used], [f"expression: the first {used} of {rows.shape[1]}"] if used < rows.shape[1] else []


def _rows(stored: StoredArrays, name: str, given: np.ndarray, frames: int) -> np.ndarray:
    rows = given.reshape(-1, given.shape[-1]) if given.ndim else given.reshape(1, 1)
    if len(rows) not in (1, frames):
        raise FileError(stored.path, f"{name} has shape {given.shape}; expected one row, or {frames}")
    return rows


def _seconds(stored: StoredArrays, frames: int, rate: float | None) -> tuple[np.ndarray | None, list[Finding]]:
    """When the frames are, by the user's rate or else the file's, and what is odd about that."""
    given = stored.first(*_FRAME_RATES)
    if frames < 2 or (given is None and rate is None):
        return None, []
    hertz = rate
    if hertz is None and given is not None:
        same = np.unique(given)  # some files have it for each frame
        if len(same) != 1:
            message = f"{stored.name(*_FRAME_RATES)} holds {len(same)} different numbers, expected one"
            return None, [Finding("wrong", message, option="`rate=HZ`")]
        hertz = float(same[0])
    assert hertz is not None
    findings = plausibility.rate(hertz)
    usable = np.isfinite(hertz) and hertz > 0
    return np.arange(frames) / hertz if usable else None, findings


def _angles(pieces: Sequence[pose_arrays.Piece], degrees: bool) -> list[Finding]:
    """Whether rotation vectors, which are radians here, can be right."""
    vectors = [piece for piece in pieces if not piece.is_absolute]
    for piece in vectors:
        findings = check.radians(piece.name, piece.rotations[check.evenly(len(piece.rotations))])
        if findings:
            return findings
    return (
        plausibility.degrees([piece.rotations[check.evenly(len(piece.rotations))] for piece in vectors])
        if degrees
        else []
    )


def _columns(pieces: Sequence[pose_arrays.Piece]) -> list[Finding]:
    """Six numbers for a rotation are two columns of a matrix here; nothing in them tells columns from rows."""
    names = [piece.name for piece in pieces if piece.form == pose_arrays.COLUMNS]
    if not names:
        return []
    note = f"{', '.join(names)}: taken as the first two columns of matrices; PyTorch3D writes their first two rows"
    return [Finding("odd", note, "save rotation vectors or matrices if these are rows")]


def _places(stored: StoredArrays, trans: np.ndarray | None, seconds: np.ndarray | None) -> list[Finding]:
    if trans is None:
        return []
    name = str(stored.name(*_TRANSLATIONS))
    return check.near_origin(name, trans[check.evenly(len(trans))]) or plausibility.speed(name, trans, seconds)


def _gender(stored: StoredArrays, body: Any, model: str) -> list[Finding]:
    """Whether the betas are of the model's gender."""
    from ..body import embedded, smpl_files

    gender = smpl_files.gender(stored.word("gender"))
    if body.name in embedded.NAMES or not gender:
        return []
    own = smpl_files.gender_of(Path(model))
    if not own or own == gender:
        return []
    what = f"the file's gender is {gender}, and the body model {body.name} is {own}"
    return [Finding("odd", what, f"`model` with the {gender} model")]


def _pass_over_repeated(stored: StoredArrays, pieces: Sequence[pose_arrays.Piece]) -> None:
    """Pieces of a pose that are in the whole pose beside them, too, are not missed."""
    for piece in pieces:
        known = pose_arrays.pieces_of()
        for name in known.keys() & stored.names - stored.used:
            joints = next((one for one in known[name] if set(one) <= set(piece.joints)), None)
            if joints is None:
                continue
            columns = [piece.joints.index(joint) for joint in joints]
            array = stored.read(name)
            whole = piece.rotations[:, columns].reshape(len(piece.rotations), -1)
            if array.size == whole.size and np.allclose(array.reshape(whole.shape), whole, equal_nan=True):
                stored.used.add(name)
