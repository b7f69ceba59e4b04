"""The person in each image: predicted, written into a folder, and analysed on the floor under the body."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from PIL import Image

import ipman_rs as ip
from ipman_rs.body import joint_regressors, pose_arrays
from ipman_rs.data import open as open_data_set
from ipman_rs.data import plausibility
from ipman_rs.files import image, path_list, write_whole
from ipman_rs.files.errors import FileError
from ipman_rs.files.item_folder import npz, write_files
from ipman_rs.files.names import Paths
from ipman_rs.io import write_mesh
from ipman_rs.progress import Progress, silent
from ipman_rs.study import Fitted, Study, camera_of, study

from .predict import TrainedModel as TrainedModel

Box = tuple[float, float, float, float]  # x, y, width, height in pixels
BoxOf = Callable[[Path, NDArray[np.uint8]], Box]  # of an image's path and pixels (h, w, 3)

PREDICTIONS = "predictions.npz"


def whole_image(path: Path, pixels: NDArray[np.uint8]) -> Box:
    """The box of a person who fills the image, pixels (h, w, 3)."""
    return 0.0, 0.0, float(pixels.shape[1]), float(pixels.shape[0])


def predict_images(
    trained: TrainedModel,
    paths: Paths,
    output: Path,
    box_of: BoxOf = whole_image,
    *,
    focal: float | None = None,
    pitch: float = 0.0,
    pictures: int = 8,
    progress: Progress = silent,
) -> tuple[list[Study], list[FileError]]:
    """The analysed body of the person in each image, and the images without one; what `write_report` takes.

    OUTPUT gets a folder for each image, with parameters (.npz) and mesh (.glb).

    Args:
        box_of: where the person is; `fitting.photo.boxes` finds it.
        focal: of all images, pixels; None: each image's diagonal.
        pitch: degrees that the camera looks down.
        pictures: so many studies, the first, bring their photo and are drawn.

    Raises:
        OSError: a folder cannot be written.
    """
    studies: list[Study] = []
    failures: list[FileError] = []
    images = path_list(paths)
    with progress("predicting", len(images)) as step:
        for number, path in enumerate(images):
            try:
                studies.append(_predict_image(trained, path, box_of, output, number < pictures, focal, pitch))
            except FileError as error:
                failures.append(error)
            step.one()
    return studies, failures


def predict_data_set(
    trained: TrainedModel,
    name: str,
    path: Path,
    output: Path,
    *,
    split: str | None = None,
    images: Path = Path(),
    regressor: str | Path | None = None,
    progress: Progress = silent,
) -> tuple[Path, int, int]:
    """The people of a data set, in its axes, in OUTPUT/predictions.npz: its path, how many are in it, and of how many.

    Args:
        images: the folder in which the paths of the data set's images begin.
        regressor: SPIN's J_regressor_extra.npy; None: that of the training. See `TrainedModel.of_data_set`.

    Raises:
        ValueError: the data set cannot be read, no image is left, or the regressor does not fit.
        OSError: the folder cannot be written.
    """
    try:
        data = open_data_set(name, path, **({} if split is None else {"split": split}))
    except TypeError as error:  # a data set without parts
        raise ValueError(f"{name}: {error}") from error
    regressor = regressor or trained.settings.model.regressor
    hips = joint_regressors.read(regressor) if regressor else None
    with progress("predicting", len(data)) as step:
        predictions = trained.of_data_set(data, images, step.to, hips)
    output.mkdir(parents=True, exist_ok=True)
    write_whole(output / PREDICTIONS, npz(predictions))
    return output / PREDICTIONS, len(predictions["names"]), len(data)


def _predict_image(
    trained: TrainedModel, path: Path, box_of: BoxOf, output: Path, pictured: bool, focal: float | None, pitch: float
) -> Study:
    """The analysed body of one image, whose files are written. FileError if it cannot be read or has an empty box."""
    try:
        pixels = image.read(path)
        box = box_of(path, pixels)
        predicted = trained.predict(Image.fromarray(pixels), box, focal, pitch)
    except ValueError as error:
        raise FileError(path, str(error)) from error
    height, width = pixels.shape[:2]
    body = trained.posing.body.body
    vertices = np.asarray(body(predicted.pose, predicted.betas, predicted.transl).vertices)
    camera = {
        "camera_rotation": predicted.rotation, "camera_translation": np.zeros(3),
        "focal": np.full(2, predicted.focal), "center": predicted.center,
    }  # fmt: skip
    arrays: dict[str, Any] = {
        **pose_arrays.split(predicted.pose[None], body), "betas": predicted.betas[None],
        "transl": predicted.transl[None], "image_size": np.array([[width, height]], float),
        "model": np.array(body.name), **{name: value[None] for name, value in camera.items()},
    }  # fmt: skip
    files = {f"{path.stem}.npz": arrays, f"{path.stem}.glb": write_mesh.glb(vertices, body.faces)}
    write_files(output / path.stem, files, {"name": path.stem, "source": str(path)})
    ground = ip.Ground.under(vertices)
    note = "predicted in one look; the floor lies under the lowest vertex"
    flags = body_flags(path, vertices, body.template, ground.normal)
    analyzed = study(path.stem, vertices, body.template, ground, source=str(path), notes=[note], flags=flags)
    shown = Fitted(
        camera=camera_of(*camera.values()), size=(width, height), seen=np.zeros((0, 3)), projected=np.zeros((0, 2)),
        photo=pixels if pictured else None, pictured=pictured, record={"box": [float(side) for side in box]},
    )  # fmt: skip
    return replace(analyzed, fitted=shown)


def body_flags(path: Path, vertices: Any, template: ip.BodyTemplate, normal: Any) -> tuple[str, ...]:
    """What is odd about a predicted body (V, 3) m, in words; normal (3,): what points up. Options of the command line
    mend files, not predictions, so none is named."""
    one = np.asarray(vertices)[None]
    findings = [
        *plausibility.bodies(one, template, normal),
        *plausibility.masses(ip.mass_properties(one, template).mass, one),
    ]
    return plausibility.admit(path, [replace(each, option="", advice="") for each in findings], force=True)
