"""Read .npz files: vertices with faces, or the parameters of a body model, one body or a sequence."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from ..body import pose_arrays, safe_npz
from ..body.joints import LEFT_HAND, RIGHT_HAND
from ..body.sequence import Index, PosedSequence, rows_of
from ..io import repair
from .errors import FileError
from .parts import match_body
from .recording import Y_UP, Z_UP, Recording

_EXPECTED = (
    "expected vertices and faces, or poses/betas/trans (AMASS), or global_orient/body_pose/betas/transl, or "
    "pose/betas/transl"
)
_FRAME_RATES = ("mocap_framerate", "mocap_frame_rate", "fps")


class _Npz:
    """Arrays of a file by name; nothing in it is executed."""

    def __init__(self, path: Path) -> None:
        self.path, self.names = path, safe_npz.names(path)

    def first(self, *names: str) -> np.ndarray | None:
        """The first of these that is there, as numbers."""
        for name in names:
            if name in self.names:
                array = safe_npz.read(self.path, name)
                if array.dtype.kind not in "fiu":
                    raise FileError(self.path, f"{name} holds {array.dtype}, not numbers; save plain numbers")
                return array
        return None

    def model(self) -> str:
        """The embedded body that `ipman fit` wrote down, or anny."""
        from ..body import embedded

        named = str(safe_npz.read(self.path, "model")) if "model" in self.names else ""
        return named if named in embedded.NAMES else "anny"


def read_npz(path: Path, model: str | None) -> Recording:
    """The bodies of an .npz file; `model` None: of the body that the file names, or anny. Raises FileError."""
    try:
        stored = _Npz(path)
        model = model or stored.model()
        if stored.names & {"vertices", "verts", "v"}:
            return _read_vertices(stored, model)
        if stored.names & {*pose_arrays.NAMES}:
            return _read_parameters(stored, model)
    except ValueError as error:
        raise FileError(path, str(error)) from error
    raise FileError(path, f"holds {', '.join(sorted(stored.names))[:120] or 'nothing'}; {_EXPECTED}")


def _read_vertices(stored: _Npz, model: str) -> Recording:
    import ipman_rs as ip

    vertices, faces = stored.first("vertices", "verts", "v"), stored.first("faces", "f")
    if vertices is None or vertices.ndim not in (2, 3) or vertices.shape[-1] != 3 or 0 in vertices.shape:
        raise FileError(stored.path, f"vertices have shape {getattr(vertices, 'shape', 0)}, not (V, 3) or (T, V, 3)")
    vertices = vertices.reshape(-1, *vertices.shape[-2:])
    if faces is None:
        body = ip.load_body(model)
        if body.num_vertices != vertices.shape[1]:
            what = f"has {vertices.shape[1]} vertices and no faces, but the body {body.name} has {body.num_vertices}"
            raise FileError(stored.path, f"{what}; add faces, or name the body with --body")
        faces = body.faces
    if faces.ndim != 2 or faces.shape[1] != 3 or len(faces) == 0 or faces.dtype.kind not in "iu":
        raise FileError(stored.path, f"faces are {faces.dtype} {faces.shape}; expected whole numbers (F, 3)")
    faces = faces.astype(np.int64)
    if faces.min() < 0 or faces.max() >= vertices.shape[1]:
        raise FileError(stored.path, f"faces name vertex {faces.max()}, but there are {vertices.shape[1]} vertices")
    mesh = repair.Mesh(vertices[0], faces)
    if match_body(faces, vertices.shape[1], model) is None:
        mesh = repair.without_unused(repair.welded(mesh) if len(vertices) == 1 else mesh)
    if len(vertices) == 1:
        vertices = mesh.vertices[None]
    elif mesh.vertex_map is not None:
        vertices = vertices[:, mesh.vertex_map >= 0]
    return Recording(
        stored.path, vertices, mesh.faces, vertex_map=mesh.vertex_map, face_map=mesh.face_map,
        seconds=_seconds(stored, len(vertices)), up=Y_UP, notes=mesh.notes,
    )  # fmt: skip


def _read_parameters(stored: _Npz, model: str) -> Recording:
    import ipman_rs as ip

    amass = "poses" in stored.names or "root_orient" in stored.names
    # AMASS stores absolute hand angles, the smplx package angles relative to the mean hand.
    body = ip.load_body(model, flat_hand_mean=True) if amass else ip.load_body(model)
    pose = _Pose(pose_arrays.read(stored.first), body)
    trans = stored.first("trans", "transl")
    if trans is not None and (trans.shape[-1:] != (3,) or trans.reshape(-1, 3).shape[0] not in (1, len(pose))):
        raise FileError(stored.path, f"trans has shape {trans.shape}; expected ({len(pose)}, 3)")
    trans = None if trans is None else trans.reshape(-1, 3)
    betas, more = _betas(stored, body, len(pose), amass)
    expression, untold = _expression(stored, body, len(pose))

    def parameters(index: Index) -> tuple[np.ndarray | None, ...]:
        return pose.of(index), *(_singles(rows, index) for rows in (betas, trans, expression))

    vertices = PosedSequence(body, len(pose), parameters)
    why = ", as AMASS has it" if amass else ""
    said = f"body: {body.name}, posed by {len(pose.names)} joints of the file"
    return Recording(
        stored.path, vertices[:].astype(np.float64) if len(pose) == 1 else vertices, body.faces, body.template,
        seconds=_seconds(stored, len(pose)), up=Z_UP if amass else Y_UP, up_why=why,
        notes=(said, *pose.notes(), *more, *untold),
    )  # fmt: skip


def _singles(rows: np.ndarray | None, index: Index) -> np.ndarray | None:
    return None if rows is None else rows_of(rows, index).astype(np.float32)


class _Pose:
    """The poses of a file, put on the joints that a body has when they are asked for."""

    def __init__(self, pieces: list[pose_arrays.Piece], body: Any) -> None:
        self._pieces, self._body = pieces, body
        self._length = max(len(piece) for piece, _ in pieces)
        self.names = tuple(name for _, names in pieces for name in names)

    def __len__(self) -> int:
        return self._length

    def of(self, index: Index) -> np.ndarray:
        """(n, J, 3) float32."""
        joints = self._body.joint_names
        count = np.zeros(self._length, dtype=bool)[index].size
        pose = np.zeros((count, len(joints), 3), np.float32)
        for piece, names in self._pieces:
            here = [k for k, name in enumerate(names) if name in joints]
            pose[:, [joints.index(names[k]) for k in here]] = rows_of(piece, index)[:, here]
        return pose

    def notes(self) -> list[str]:
        """What was left out."""
        left_out = [name for name in self.names if name not in self._body.joint_names]
        if not left_out:
            return []
        missing = f"for the body {self._body.name} has no {_kind(left_out)}"
        return [f"pose: {len(left_out)} joints are left out, {missing}"]


def _kind(joints: list[str]) -> str:
    fingers = [name for name in joints if name in LEFT_HAND or name in RIGHT_HAND]
    others = [name.replace("_", " ") for name in joints if name not in fingers]
    return " or ".join((["fingers"] if fingers else []) + others)


def _betas(stored: _Npz, body: Any, frames: int, amass: bool) -> tuple[np.ndarray | None, list[str]]:
    import ipman_rs as ip

    betas = stored.first("betas", "shape")
    if betas is None:
        return None, ["shape: the body's mean (the file has no betas)"]
    if amass and body.name in ip.body.embedded.NAMES:
        return None, [f"shape: the mean of {body.name} (the file's betas belong to SMPL; --body FILE uses them)"]
    rows = betas.reshape(-1, betas.shape[-1]) if betas.ndim else betas.reshape(1, 1)
    if len(rows) not in (1, frames):
        raise FileError(stored.path, f"betas have shape {betas.shape}; expected one row, or {frames}")
    used = min(rows.shape[1], body.num_betas)
    notes = [f"shape: the first {used} of {rows.shape[1]} betas"] if used < rows.shape[1] else []
    return rows[:, :used], notes


def _expression(stored: _Npz, body: Any, frames: int) -> tuple[np.ndarray | None, list[str]]:
    """The face's expression, rows (1 or T, E), and what of it was left out."""
    given = stored.first("expression")
    if given is None or not given.any():
        return None, []
    rows = given.reshape(-1, given.shape[-1]) if given.ndim else given.reshape(1, 1)
    if len(rows) not in (1, frames):
        raise FileError(stored.path, f"expression has shape {given.shape}; expected one row, or {frames}")
    used = min(rows.shape[1], body.num_expressions)
    if not used:
        return None, [f"expression: left out, for the body {body.name} has none"]
    return rows[:, :used], [f"expression: the first {used} of {rows.shape[1]}"] if used < rows.shape[1] else []


def _seconds(stored: _Npz, frames: int) -> np.ndarray | None:
    rate = stored.first(*_FRAME_RATES)
    if rate is None or frames < 2 or rate.size != 1 or not np.isfinite(rate).all() or rate.reshape(()) <= 0:
        return None
    return np.arange(frames) / float(rate.reshape(()))
