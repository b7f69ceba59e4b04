"""Bodies for images from a trained regressor: in a world whose up is the camera's, but for its pitch, or in that of a
data set."""

from __future__ import annotations

import os
import warnings
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import torch
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

import ipman_rs.torch as ipt
from ipman_rs.body import BodyModel
from ipman_rs.body.joint_regressors import JointRegressor
from ipman_rs.data import DataSet

from .augment import ROOM, Augmentation, crop, to_crop
from .batch import Batch
from .model import HMR
from .model.build import build_model
from .model.keypoint_encoder import KEYPOINTS
from .model.trained_weights import read_trained
from .posed_estimate import HIPS, REGRESSED_HIPS, Posing, check_regressor
from .sources import BadSample, Images
from .trainer.config import TrainingConfig, config_of

Array = NDArray[np.floating]

PREDICTED = ("names", "pose", "betas", "transl")


@dataclass(frozen=True, eq=False)
class Prediction:
    """pose (J, 3), the root's turn in the world first, betas (b,), transl (3,) m: the body in a world with y up whose
    origin is the camera. rotation (3, 3): world to camera. focal, center (2,): pixels."""

    pose: Array
    betas: Array
    transl: Array
    rotation: Array
    focal: float
    center: Array


@dataclass(frozen=True)
class TrainedModel:
    """A regressor of images, its configuration, and its body."""

    model: HMR
    settings: TrainingConfig
    posing: Posing

    @classmethod
    def load(cls, path: str | os.PathLike[str]) -> TrainedModel:
        """A checkpoint of `ipman train`. ValueError, naming the file, for another file or a regressor of keypoints."""
        config, weights = read_trained(path)
        settings = config_of(config)
        if settings.model.backbone == "keypoints":
            raise ValueError(f"{path}: this regressor sees keypoints, not images")
        posing = Posing(ipt.BodyModel(settings.body), KEYPOINTS)
        model = build_model(settings, posing.body.body, start=False)
        model.load_state_dict(weights)
        return cls(model.eval(), settings, posing)

    @torch.no_grad()
    def of_data_set(
        self,
        data: DataSet,
        images: Path = Path(),
        progress: Callable[[int], None] = lambda done: None,
        regressor: JointRegressor | None = None,
    ) -> dict[str, Array]:
        """The people of a data set with images, as `ipman evaluate` reads them.

        names (F,); pose (F, J, 3), betas (F, b) and transl (F, 3) in the axes of its bodies; and body, a word.

        images: the folder in which their paths begin. As in the authors' code, the middle of the estimated hips is put
        where that of the true ones is: of the body's joints or, where the data set labels hips of its own, of those
        that `regressor` makes (SPIN's `J_regressor_extra.npy`). Frames whose image cannot be read are warned of and
        left out; progress is told how many are done. ValueError: none is left, or a regressor that does not fit.
        """
        body = self.posing.body.body
        if regressor is not None:
            check_regressor(regressor, body)
        size = self.settings.model.size
        source = Images(data, body, KEYPOINTS, size, folder=images, regressed=regressor is not None)
        rows: list[tuple[Any, ...]] = []
        for row in range(len(data)):
            try:
                batch = Batch.of([source.sample(row, None)])
            except BadSample as error:
                warnings.warn(f"left out: {error}", stacklevel=2)
                continue
            estimate = self.model(batch.inputs)
            matrices, betas = estimate.rotations[0].double().numpy(), estimate.betas[0].double().numpy()
            matrices[0] = batch.camera[0].double().numpy().T @ matrices[0]
            pose = Rotation.from_matrix(matrices).as_rotvec()
            hips = _hips(body, pose, betas, regressor if batch.regressed[0] else None)
            name = str(data[slice(row, row + 1)].names[0])
            rows.append((name, pose, betas, batch.hips[0].double().numpy() - hips))
            progress(row + 1)
        if not rows:
            raise ValueError("data: none of its images can be read")
        predictions = {key: np.array(column) for key, column in zip(PREDICTED, zip(*rows, strict=True), strict=True)}
        return {**predictions, "body": np.array(body.kind)}

    @torch.no_grad()
    def predict(self, image: Any, box: Sequence[float], focal: float | None = None, pitch: float = 0.0) -> Prediction:
        """The person in a box (x, y, width, height) of a PIL image.

        focal: pixels; None: the image's diagonal. pitch: degrees that the camera looks down. ValueError for an empty
        box.
        """
        change = Augmentation()
        whole = to_crop(box, change)
        estimate = self.model(crop(image, box, change, self.settings.model.size)[None])
        matrices = estimate.rotations[0].double().numpy()
        betas = estimate.betas[0].double().numpy()
        scale, *shift = estimate.camera[0].double().tolist()
        focal = float(np.hypot(*image.size)) if focal is None else focal
        center = 0.5 * np.array(image.size, float)
        # The crop's camera is far away; the same size and place in the image, seen by this camera, is nearer.
        half = 0.5 * ROOM * max(float(box[2]), float(box[3]))
        depth = focal / (scale * half)
        aside = (-whole[:, 2] * half - center) * depth / focal  # of the crop's middle from the image's
        body = self.posing.body.body
        pelvis = body.J_template[0] + body.J_shapedirs[0] @ betas
        turn = Rotation.from_rotvec([np.radians(pitch), 0.0, 0.0]).as_matrix()
        rotation = np.diag([1.0, -1.0, -1.0]) @ turn
        in_camera = pelvis + [shift[0] + aside[0], shift[1] + aside[1], depth]
        matrices[0] = rotation.T @ matrices[0]
        pose = Rotation.from_matrix(matrices).as_rotvec()
        return Prediction(pose, betas, rotation.T @ in_camera - pelvis, rotation, focal, center)


def _hips(body: BodyModel, pose: Array, betas: Array, regressor: JointRegressor | None) -> Array:
    """The middle (3,) of a body's hips where it stands without translation."""
    posed = body(pose, betas)
    if regressor is None:
        return np.asarray(posed.joints)[list(HIPS)].mean(axis=0)
    return regressor.joints(np.asarray(posed.vertices))[list(REGRESSED_HIPS)].mean(axis=0)
