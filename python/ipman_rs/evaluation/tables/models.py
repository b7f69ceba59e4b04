"""The body models of frames: embedded ones, and the user's files of SMPL, SMPL+H and SMPL-X."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

import ipman_rs as ip
from ipman_rs.body import BodyModel, embedded, formats, mesh_file
from ipman_rs.body.hands import Hands
from ipman_rs.data.frames import Frames

GENDERS = ("neutral", "male", "female")
_ENDINGS = (".npz", ".pkl")


@dataclass(frozen=True, eq=False)
class FrameBodies:
    """The posed bodies of F frames, as far as the frames have them; arrays (F, n, 3) m."""

    kind: str | None  # "smpl", "anny" …
    model: BodyModel | None  # whose faces and parts the vertices have
    vertices: NDArray[Any] | None
    model_joints: NDArray[Any] | None  # of the posed body model
    file_joints: NDArray[Any] | None  # that the frames name themselves: measured, or predicted without a body
    file_joint_names: tuple[str, ...]
    missing_model: str | None = None  # such as SMPLX_FEMALE: the model file that the poses need and that is not there

    @property
    def model_joint_names(self) -> tuple[str, ...]:
        return () if self.model_joints is None or self.model is None else self.model.joint_names

    @property
    def joints(self) -> NDArray[Any] | None:
        """The joints named by `joint_names`: of the body model if there is one, else of the file."""
        return self.file_joints if self.model_joints is None else self.model_joints

    @property
    def joint_names(self) -> tuple[str, ...]:
        return self.file_joint_names if self.model_joints is None else self.model_joint_names


@dataclass(eq=False)
class Models:
    """Body models, loaded when needed. folder: model files are anywhere below it; None: embedded ones only."""

    folder: Path | None = None
    _loaded: dict[tuple[str, str, int, str | None], BodyModel] = field(default_factory=dict)

    def get(self, kind: str, gender: str = "neutral", betas: int = 10, rest_shape: str | None = None) -> BodyModel:
        """The model of a kind (one of `body.formats.FORMATS`, or an embedded one's name).

        `rest_shape`: a mesh file of a person's own body in the zero pose, instead of the model's mean. ValueError if
        there is no file, or if the mesh has other vertices than the model.
        """
        if kind in embedded.NAMES:
            return ip.load_body(kind)
        key = (kind, gender, betas, rest_shape)
        if key not in self._loaded:
            template = None if rest_shape is None else mesh_file.vertices(rest_shape)
            # The hands of frames are rotations, not offsets from a mean hand.
            self._loaded[key] = ip.load_body(
                self.file(kind, gender), num_betas=betas, flat_hand_mean=True, v_template=template
            )
        return self._loaded[key]

    def hands(self) -> Hands | None:
        """The mean hands and hand components of SMPL-X, in which RICH gives its fingers; None without its file."""
        files = self.files("smplx")
        return ip.load_body(files[0]).hands if files else None

    def template_of(self, kind: str, wanted: str = "neutral") -> BodyModel:
        """The model whose faces, parts and samples all bodies of a kind share, whatever their gender. ValueError, with
        the file of the `wanted` gender, if there is none."""
        if kind in embedded.NAMES:
            return ip.load_body(kind)
        for gender in GENDERS:
            if self._found(kind, gender) is not None:
                return self.get(kind, gender)
        return self.get(kind, wanted)

    def has(self, kind: str) -> bool:
        """Whether there is a model of that kind, of some gender."""
        return kind in embedded.NAMES or bool(self.files(kind))

    def files(self, kind: str) -> list[Path]:
        """The model files of a kind, of all genders."""
        paths = [self._found(kind, gender) for gender in GENDERS]
        return sorted({path for path in paths if path is not None})

    def posed(self, frames: Frames) -> FrameBodies:
        """Vertices and joints of the frames. ValueError if a pose does not match its model, or if frames have only a
        pose and its model is missing."""
        vertices, own, kind = frames.vertices, None, frames.body
        needed = vertices is None and frames.joints is None
        model = None if kind is None or not (needed or self.has(kind)) else self.template_of(kind, _genders(frames)[0])
        if frames.pose is not None and kind is not None and model is not None and vertices is None:
            vertices, own = self._skinned(frames, kind)
        lacking = file_of(frames) if frames.pose is not None and vertices is None else None
        return FrameBodies(kind, model, vertices, own, frames.joints, tuple(frames.joint_names or ()), lacking)

    def _skinned(self, frames: Frames, kind: str) -> tuple[NDArray[Any], NDArray[Any]]:
        pose = np.asarray(frames.pose)
        width = 10 if frames.betas is None else frames.betas.shape[1]
        genders = np.full(len(frames), "neutral") if frames.genders is None else np.asarray(frames.genders)
        shape = self.template_of(kind)
        vertices, joints = np.zeros((0, shape.num_vertices, 3)), np.zeros((0, shape.num_joints, 3))
        for number, gender in enumerate(np.unique(genders)):
            rows = np.flatnonzero(genders == gender)
            model = self.get(kind, str(gender), width, frames.rest_shape)
            betas = None if frames.rest_shape is not None else frames.betas
            posed = model(
                formats.on_joints(pose[rows], model, kind),
                None if betas is None else betas[rows, : model.num_betas],
                None if frames.transl is None else frames.transl[rows],
            )
            if number == 0:
                vertices = np.empty((len(frames), *posed.vertices.shape[1:]), posed.vertices.dtype)
                joints = np.empty((len(frames), *posed.joints.shape[1:]), posed.joints.dtype)
            vertices[rows], joints[rows] = posed.vertices, posed.joints
        return vertices, joints

    def file(self, kind: str, gender: str) -> Path:
        path = self._found(kind, gender)
        if path is not None:
            return path
        where = "no folder is named by `models`" if self.folder is None else f"there is none under {self.folder}"
        raise ValueError(f"the body {kind} ({gender}) needs its model file, {_stem(kind, gender)}.npz or .pkl: {where}")

    def _found(self, kind: str, gender: str) -> Path | None:
        if self.folder is None:
            return None
        downloaded = formats.FORMATS[kind].downloaded if kind in formats.FORMATS else {}
        stems = [f"{kind}_{gender}", *([downloaded[gender]] if gender in downloaded else [])]
        files = sorted(path for path in self.folder.rglob("*") if path.suffix.lower() in _ENDINGS)
        return next((path for stem in stems for path in files if path.stem.lower().startswith(stem)), None)


def file_of(frames: Frames) -> str | None:
    """The model file that these frames need first, without its ending, such as SMPLX_FEMALE; None without a body."""
    return None if frames.body is None else _stem(frames.body, _genders(frames)[0])


def _stem(kind: str, gender: str) -> str:
    return f"{kind.upper()}_{gender.upper()}"


def _genders(frames: Frames) -> list[str]:
    """The genders of the people, without repetition."""
    return ["neutral"] if frames.genders is None or not len(frames) else np.unique(frames.genders).tolist()
