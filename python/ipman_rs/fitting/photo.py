"""People in photos, found by MediaPipe Pose. Needs the extra `photo`: pip install "ipman_rs[photo]"."""

from __future__ import annotations

import os
import warnings
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ipman_rs.files.image import SMALLEST as SMALLEST
from ipman_rs.files.image import read as read

from ..data.keypoints import mediapipe
from ..data.keypoints.detections import Array, Detections, join

Box = tuple[float, float, float, float]  # x, y, width, height in pixels

AROUND = 0.04  # of the longer side: how far a body reaches beyond its landmarks; the median of rendered people


def detect(paths: Sequence[str | os.PathLike[str]]) -> Detections:
    """The person in each image, a row each: MediaPipe's landmarks in pixels, and its world landmarks.

    MediaPipe finds one person an image. ImportError without the extra; ValueError, naming the file, for a missing or
    unreadable image, one under 32 pixels, and one without a person.
    """
    with _model() as model:
        return join([_detections(path, *_landmarks(model, path, read(path))) for path in paths])


def landmarks(path: str | os.PathLike[str]) -> tuple[Array, Array, tuple[int, int]]:
    """MediaPipe's landmarks (33, 4) relative to the image, world landmarks (33, 4), and the image's width and height.

    What `keypoints.mediapipe.write` takes. Raises as `detect`.
    """
    with _model() as model:
        return _landmarks(model, path, read(path))


@contextmanager
def detector() -> Iterator[Callable[[str | os.PathLike[str]], Detections]]:
    """Gives a function that finds the person in one image after the other, a row; both raise as `detect`."""
    with _model() as model:
        yield lambda path: _detections(path, *_landmarks(model, path, read(path)))


@contextmanager
def boxes() -> Iterator[Callable[[str | os.PathLike[str], NDArray[np.uint8]], Box]]:
    """Gives a function of an image's name and pixels: the person's box in it, around MediaPipe's landmarks.

    ImportError without the extra. The function raises ValueError, with the name, for an image without a person.
    """
    with _model() as model:
        yield lambda path, pixels: box_around(_detections(path, *_landmarks(model, path, pixels)).points[0])


def box_around(points: Array) -> Box:
    """The box of a body whose landmarks (N, 2) these are."""
    low, high = points.min(axis=0), points.max(axis=0)
    margin = AROUND * (high - low).max()
    x, y = (low - margin).tolist()
    width, height = (high - low + 2 * margin).tolist()
    return x, y, width, height


def _model() -> Any:
    """The model whose weights are in MediaPipe's wheel; each image by itself, as none follows another."""
    try:
        from mediapipe.python.solutions import pose  # pyright: ignore[reportMissingImports]
    except ImportError as error:
        raise ImportError(f'photos need MediaPipe: pip install "ipman_rs[photo]" ({error})') from error
    return pose.Pose(static_image_mode=True, model_complexity=1)


def _landmarks(
    model: Any, path: str | os.PathLike[str], pixels: NDArray[np.uint8]
) -> tuple[Array, Array, tuple[int, int]]:
    with warnings.catch_warnings():
        warnings.filterwarnings("ignore", "SymbolDatabase.GetPrototype", UserWarning)  # between MediaPipe and protobuf
        result = model.process(pixels)
    if result.pose_landmarks is None:
        raise ValueError(f"{path}: expected a person, found none")
    height, width = pixels.shape[:2]
    return _four(result.pose_landmarks), _four(result.pose_world_landmarks), (width, height)


def _four(landmarks: Any) -> Array:
    return np.array([[point.x, point.y, point.z, point.visibility] for point in landmarks.landmark])


def _detections(path: str | os.PathLike[str], landmarks: Array, world: Array, size: tuple[int, int]) -> Detections:
    rows = [index for index, name in enumerate(mediapipe.NAMES) if name is not None]
    landmarks, world = landmarks[rows], world[rows]
    return Detections(
        tuple(name for name in mediapipe.NAMES if name is not None),
        landmarks[None, :, :2] * size,
        landmarks[None, :, 3].clip(0, 1),
        (str(path),),
        np.array([size], float),
        world[None, :, :3],
        world[None, :, 3].clip(0, 1),
    )
