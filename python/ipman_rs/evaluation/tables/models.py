"""The body models that frames name: embedded ones, and SMPL, SMPL+H and SMPL-X files in a folder of the user's."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

import ipman_rs as ip
from ipman_rs.body import BodyModel, embedded
from ipman_rs.data.frames import Frames

GENDERS = ("neutral", "male", "female")
_ENDINGS = (".npz", ".pkl")
# Names under which SMPL itself is downloaded; all else is called SMPLX_NEUTRAL.npz and so on.
_DOWNLOADED = {"neutral": "basicmodel_neutral_lbs", "male": "basicmodel_m_lbs", "female": "basicmodel_f_lbs"}
_BODY_JOINTS = 22  # of every model of the family, in one order


@dataclass(frozen=True, eq=False)
class Bodies:
    """Posed bodies, or what the frames have of them; arrays (F, n, 3) m."""

    vertices: NDArray[Any] | None
    joints: NDArray[Any] | None
    joint_names: tuple[str, ...]
    model: BodyModel | None  # whose faces and parts the vertices have


@dataclass(eq=False)
class Models:
    """`folder`: where model files are, anywhere below it, or None."""

    folder: Path | None = None
    _loaded: dict[tuple[str, str, int], BodyModel] = field(default_factory=dict)

    def get(self, kind: str, gender: str = "neutral", betas: int = 10) -> BodyModel:
        """The model of a kind ("smpl", "smplh", "smplx", or an embedded one's name). ValueError if there is no file."""
        if kind in embedded.NAMES:
            return ip.load_body(kind)
        key = (kind, gender, betas)
        if key not in self._loaded:
            # The hands of frames are rotations, not offsets from a mean hand.
            self._loaded[key] = ip.load_body(self.file(kind, gender), num_betas=betas, flat_hand_mean=True)
        return self._loaded[key]

    def template_of(self, kind: str) -> BodyModel:
        """The model whose faces, parts and samples all bodies of a kind share, whatever their gender."""
        if kind in embedded.NAMES:
            return ip.load_body(kind)
        for gender in GENDERS:
            if self._found(kind, gender) is not None:
                return self.get(kind, gender)
        return self.get(kind)

    def has(self, kind: str) -> bool:
        """Whether there is a model of that kind, of some gender."""
        return kind in embedded.NAMES or bool(self.files(kind))

    def files(self, kind: str) -> list[Path]:
        """Of that kind, of any gender."""
        found = [self._found(kind, gender) for gender in GENDERS]
        return sorted({path for path in found if path is not None})

    def posed(self, frames: Frames) -> Bodies:
        """Vertices and joints of the frames. ValueError where a pose does not fit its model, or where the pose is all
        that there is and its model is not."""
        vertices, joints = frames.vertices, frames.joints
        names = tuple(frames.joint_names or ())
        needed = vertices is None and joints is None
        model = None if frames.body is None or not (needed or self.has(frames.body)) else self.template_of(frames.body)
        if frames.pose is not None and frames.body is not None and model is not None and vertices is None:
            vertices, own = self._skinned(frames, frames.body)
            if joints is None and model is not None:
                joints, names = own, model.joint_names
        return Bodies(vertices, joints, names, model)

    def _skinned(self, frames: Frames, kind: str) -> tuple[NDArray[Any], NDArray[Any]]:
        pose = np.asarray(frames.pose)
        width = 10 if frames.betas is None else frames.betas.shape[1]
        genders = np.full(len(frames), "neutral") if frames.genders is None else np.asarray(frames.genders)
        shape = self.template_of(kind)
        vertices, joints = np.zeros((0, shape.num_vertices, 3)), np.zeros((0, shape.num_joints, 3))
        for number, gender in enumerate(np.unique(genders)):
            rows = np.flatnonzero(genders == gender)
            model = self.get(kind, str(gender), width)
            posed = model(
                _on_joints(pose[rows], model),
                None if frames.betas is None else frames.betas[rows, : model.num_betas],
                None if frames.transl is None else frames.transl[rows],
            )
            if number == 0:
                vertices = np.empty((len(frames), *posed.vertices.shape[1:]), posed.vertices.dtype)
                joints = np.empty((len(frames), *posed.joints.shape[1:]), posed.joints.dtype)
            vertices[rows], joints[rows] = posed.vertices, posed.joints
        return vertices, joints

    def file(self, kind: str, gender: str) -> Path:
        found = self._found(kind, gender)
        if found is not None:
            return found
        name = f"{kind.upper()}_{gender.upper()}"
        where = "no folder is named by --models" if self.folder is None else f"there is none under {self.folder}"
        raise ValueError(f"the body {kind} ({gender}) needs its model file, {name}.npz or .pkl: {where}")

    def _found(self, kind: str, gender: str) -> Path | None:
        if self.folder is None:
            return None
        stems = [f"{kind}_{gender}", *([_DOWNLOADED[gender]] if kind == "smpl" else [])]
        files = sorted(path for path in self.folder.rglob("*") if path.suffix.lower() in _ENDINGS)
        return next((path for stem in stems for path in files if path.stem.lower().startswith(stem)), None)


def _on_joints(pose: NDArray[Any], model: BodyModel) -> NDArray[Any]:
    """A pose (F, j, 3) on the joints of a model: those that it lacks at the end (hands, face) are at rest."""
    given, wanted = pose.shape[1], model.num_joints
    if given == wanted:
        return pose
    if not _BODY_JOINTS <= given < wanted:
        raise ValueError(f"pose: has {given} joints, but the body {model.name} has {wanted}; is the right body named?")
    # Of SMPL's 24 joints the last two are the hands, which other models have as fingers, or not at all.
    kept = given if given != 24 else _BODY_JOINTS
    filled = np.zeros((len(pose), wanted, 3), pose.dtype)
    filled[:, :kept] = pose[:, :kept]
    return filled
