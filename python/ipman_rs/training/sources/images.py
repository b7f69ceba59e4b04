"""Images of a data set of `ipman_rs.data` with their labels, cropped and augmented."""

from __future__ import annotations

import warnings
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor

from ipman_rs.body import BodyModel, rotations
from ipman_rs.data import DataSet, Frames
from ipman_rs.files import regular_file

from ..augment import Augmentation, AugmentConfig, Pixels, augment_labels, augmented_crop, normalised, to_crop
from ..posed_estimate import HIPS, REGRESSED
from .source import BadSample

Array = NDArray[np.floating]

# Data sets with joints of their own mean other points by "pelvis", "neck" or "head" than SMPL does. In these they
# agree, in the hips but for centimetres: with SPIN's regressor they are labels of those that it makes.
SHARED = tuple(f"{side}_{name}" for side in ("left", "right") for name in (
    "hip", "knee", "ankle", "shoulder", "elbow", "wrist",
))  # fmt: skip


class Images:
    """Frames of one data set for a body model.

    keypoints: names of those that are asked for; a data set's others are left out. size: pixels of a crop's side.
    folder: where the paths of images begin, unless the data set brings its images. augmenting: how samples are changed
    where a generator is given. regressed: hips and other joints that SMPL does not have are labels of those that SPIN's
    regressor makes (`posing.REGRESSED`). Pose and betas of another body model count as not labelled. Frames without
    cameras give the body in camera axes, as SPIN's files do; they have no world.

    Where a person stands is told by the middle of the hips: by the body's joints, where the data set has these or the
    body itself (neutral, in the world); else by the hips that it labels.
    """

    def __init__(
        self,
        data: DataSet,
        body: BodyModel,
        keypoints: Sequence[str],
        size: int = 224,
        augmenting: AugmentConfig | None = None,
        folder: Path = Path(),
        regressed: bool = False,
    ) -> None:
        self.data, self.body, self.keypoints, self.size, self.folder = data, body, tuple(keypoints), size, folder
        self.augmenting, self.regressed = augmenting or AugmentConfig(), regressed
        self.joints = (*body.joint_names, *(REGRESSED if regressed else ()))
        self._warned = False

    def __len__(self) -> int:
        return len(self.data)

    def sample(self, row: int, draw: np.random.Generator | None) -> dict[str, Tensor]:
        change = Augmentation() if draw is None else self.augmenting.draw(draw)
        pixels, labels = self.cut(row, change)
        gains = torch.tensor([change.gains], dtype=torch.float64)
        return {**labels, "inputs": normalised(torch.from_numpy(pixels)[None], gains)[0]}

    def cut(self, row: int, change: Augmentation) -> tuple[Pixels, dict[str, Tensor]]:
        """The augmented crop, its colours as they are, and its labels: fields of `Batch`, less inputs."""
        frame = self.data[slice(row, row + 1)]
        if frame.boxes is None:
            raise BadSample(f"{frame.names[0]}: no box around the person")
        box = frame.boxes[0].tolist()
        try:
            whole = to_crop(box, change)
            pixels = augmented_crop(self._image(frame, row), box, change, self.size)
        except (OSError, SyntaxError, ValueError) as error:
            raise BadSample(f"{frame.names[0]}: {error}") from None
        return pixels, augment_labels(self.labels(frame), whole, change, self.keypoints, self.joints)

    def labels(self, frame: Frames) -> dict[str, Tensor]:
        """Of the one image as it is: fields of `Batch`, keypoints in pixels. What is not labelled has zeros."""
        labelled = frame.pose is not None and frame.betas is not None and self._is_own(frame.body)
        camera = np.eye(3) if frame.cameras is None else np.asarray(frame.cameras.rotation[0], float)
        pose = np.tile(np.eye(3), (self.body.num_joints, 1, 1))
        betas = np.zeros(self.body.num_betas)
        if labelled:
            assert frame.pose is not None
            assert frame.betas is not None
            pose = rotations.from_axis_angle(np.asarray(frame.pose[0], float))
            pose[0] = camera @ pose[0]
            count = min(len(betas), frame.betas.shape[1])
            betas[:count] = frame.betas[0, :count]
        among = None if self._are_own(frame.joint_names) else (*SHARED, *REGRESSED)
        joints = _named(frame.joints, self._names(frame.joint_names), self.joints, 3, among)
        hips, regressed = self._hips(frame, joints, labelled)
        joints[:, :3] = joints[:, :3] @ camera.T
        world = frame.cameras is not None and frame.ground is not None and hips is not None
        ground = _plane(frame)
        return {
            "keypoints": _single(_named(frame.keypoints, self._names(frame.keypoint_names), self.keypoints, 2)),
            "joints": _single(joints),
            "pose": _single(pose),
            "betas": _single(betas),
            "has_body": torch.tensor(labelled),
            "camera": _single(camera),
            "hips": _single(np.zeros(3) if hips is None else hips),
            "regressed": torch.tensor(regressed),
            "up": _single(ground[0]),
            "height": _single(ground[1]),
            "has_world": torch.tensor(world),
            "standing": torch.tensor(_flag(frame.standing)),
            "contact": torch.tensor(_flag(frame.contact)),
        }

    def _hips(self, frame: Frames, joints: Array, labelled: bool) -> tuple[Array | None, bool]:
        """Their middle (3,) in the axes of the frame, None where nothing tells it; whether it is the regressor's."""
        if self._are_own(frame.joint_names) and (of_joints := _middle(joints, HIPS)) is not None:
            return of_joints, False
        of_body = self._hips_of_body(frame) if labelled else None
        gender = "neutral" if frame.genders is None else str(frame.genders[0])
        if of_body is not None and gender == "neutral":
            return of_body, False
        if self.regressed:
            rows = [self.joints.index(f"{side}_hip_regressed") for side in ("left", "right")]
            if (of_regressed := _middle(joints, rows)) is not None:
                return of_regressed, True
        of_joints = _middle(joints, HIPS)
        hips = of_body if of_joints is None else of_joints
        if hips is not None and frame.ground is not None:
            self._warn(frame, "of its joints" if of_joints is not None else f"of a {gender} body")
        return hips, False

    def _hips_of_body(self, frame: Frames) -> Array | None:
        """Of the labelled body; None where it has no place or is not finite."""
        if frame.pose is None or frame.betas is None or frame.transl is None:
            return None
        betas = frame.betas[0, : self.body.num_betas]
        hips = np.asarray(self.body(frame.pose[0], betas, frame.transl[0]).joints, float)[list(HIPS)]
        return hips.mean(axis=0) if np.isfinite(hips).all() else None

    def _warn(self, frame: Frames, which: str) -> None:
        if not self._warned:
            self._warned = True
            warnings.warn(
                f"{frame.names[0]}: bodies are put where the data set's hips are, {which}, which may lie centimetres "
                f"from those of the body {self.body.name!r}; SPIN's J_regressor_extra.npy (model.regressor, "
                "`regressors`) makes the same ones where a data set labels hips",
                stacklevel=4,
            )

    def _are_own(self, names: Sequence[str] | None) -> bool:
        return tuple(names or ()) == self.body.joint_names

    def _names(self, names: Sequence[str] | None) -> Sequence[str] | None:
        """A data set's names of points: those that mean what the regressor makes are called as in `REGRESSED`."""
        if names is None or not self.regressed or "spine1" in names:  # names of SMPL's family
            return names
        return [f"{name}_regressed" if f"{name}_regressed" in REGRESSED else name for name in names]

    def _is_own(self, name: str | None) -> bool:
        """Whether parameters of the body `name` are those of this model."""
        return name == self.body.kind

    def _image(self, frame: Frames, row: int) -> Any:
        """A PIL image: the data set's own, or the file that the frame names."""
        from PIL import Image

        own = getattr(self.data, "image", None)
        if own is not None:
            return Image.fromarray(own(row))
        if frame.images is None:
            raise BadSample(f"{frame.names[0]}: no image")
        with Image.open(regular_file(self.folder / str(frame.images[0])), formats=("JPEG", "PNG")) as image:
            return image.convert("RGB")


def _named(
    points: Array | None,
    names: Sequence[str] | None,
    wanted: Sequence[str],
    size: int,
    among: Sequence[str] | None = None,
) -> Array:
    """The wanted points of a frame (len(wanted), size + 1), confidence last, 0 for those it lacks or that are not
    `among`."""
    values = np.zeros((len(wanted), size + 1))
    if points is None or names is None:
        return values
    rows = {name: row for row, name in enumerate(names)}
    for index, name in enumerate(wanted):
        if name in rows and (among is None or name in among):
            point = np.asarray(points[0, rows[name]], float)
            values[index, :size] = point[:size]
            values[index, size] = point[size] if len(point) > size else 1.0
    return values


def _middle(joints: Array, rows: Sequence[int]) -> Array | None:
    """Of two joints (N, 4) with confidence; None if one is not labelled."""
    both = joints[list(rows)]
    return both[:, :3].mean(axis=0) if (both[:, 3] > 0).all() and np.isfinite(both).all() else None


def _plane(frame: Frames) -> tuple[Array, Array]:
    """Normal (3,) and height () of the ground."""
    if frame.ground is None:
        return np.array([0.0, 1.0, 0.0]), np.array(0.0)
    normal, height = np.asarray(frame.ground.normal, float), np.asarray(frame.ground.height, float)
    return normal.reshape(-1, 3)[0], height.reshape(-1)[0]


def _flag(flags: Any) -> bool:
    """Of one frame: a data set without the label claims nothing."""
    return flags is not None and bool(flags[0])


def _single(array: Any) -> Tensor:
    return torch.from_numpy(np.array(array, np.float32))
