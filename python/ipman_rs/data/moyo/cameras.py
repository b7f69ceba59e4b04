"""MoYo's cameras and their images."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from ipman_rs.files import read_json

from ..frames import Cameras, Frames
from .files import SequenceFiles

Array = NDArray[np.float64]

IMAGE_RATE = 30.0  # Hz
IMAGE_SCALE = 0.5  # of released images to those that were calibrated


def frames_with_images(files: SequenceFiles, camera: int, count: int) -> NDArray[np.int64]:
    """The frames that the camera has images of."""
    numbers = (path.stem.rpartition("_")[2] for path in files.images(camera).glob("*.*"))
    rows = sorted({2 * int(number) for number in numbers if number.isdigit()})
    return np.array([row for row in rows if row < count], np.int64)


def with_camera(files: SequenceFiles, frames: Frames, camera: int, rows: NDArray[np.int64]) -> Frames:
    count = len(frames)
    by_number = {int(path.stem.rpartition("_")[2]): path for path in files.images(camera).glob("*.*")}
    view = _camera(files, camera)
    spread = (np.broadcast_to(part, (count, *part.shape)) for part in view)
    images = np.array([str(by_number[row // 2]) for row in rows.tolist()] or np.empty(0, "U1"))
    rate = None if frames.frame_rate is None else IMAGE_RATE
    return replace(frames, frame_rate=rate, images=images, cameras=Cameras(*spread))


def _camera(files: SequenceFiles, camera: int) -> tuple[Array, Array, Array]:
    """Rotation, translation and intrinsics of a camera on the sequence's day."""
    day = files.name.split("_")[0]
    paths = sorted(files.session.glob("cameras/**/cameras_param.json"))
    paths = [path for path in paths if any(day in part for part in path.relative_to(files.session).parts)] or paths
    if len(paths) != 1:
        raise ValueError(f"{files.session}: expected one cameras/**/{day}*/**/cameras_param.json, got {len(paths)}")
    content = read_json(paths[0])
    try:
        view = content[f"cam_{camera}"]
        rotation = np.array(view["rotation"], float).reshape(3, 3)
        position = np.array(view["position"], float).reshape(3)
        focal, center = float(view["focal"]), np.array(view["princpt"], float).reshape(2)
    except (ValueError, LookupError, TypeError, OverflowError) as error:
        raise ValueError(
            f"{paths[0]}: expected cam_{camera} with focal, princpt, rotation, position: {error!r}"
        ) from None
    if np.linalg.norm(position) < 20:
        raise ValueError(f"{paths[0]}: position: looks like metres: {position}, expected millimetres")
    intrinsics = np.array([[focal, 0, center[0]], [0, focal, center[1]], [0, 0, 1]])
    return rotation, -rotation @ position / 1000, np.diag([IMAGE_SCALE, IMAGE_SCALE, 1.0]) @ intrinsics
