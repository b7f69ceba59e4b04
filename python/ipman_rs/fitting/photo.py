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

PARTS = (0.6, 0.4, 0.27)  # of the image's sides, looked at where nobody is found in the whole of it
PIECE = 0.6  # of the landmarks: so many of a piece lie in the box of the person that it belongs to
SMALL = 0.35  # of the tallest person: who is smaller is left out where all people are asked for
WHOLE = 0.9  # of the landmarks: so many lie in the part in which somebody is seen
SAME = 0.15  # of a person's size: how far apart two finds of the same person are at most
SURE = 0.5  # median visibility from which a person in a part counts
AROUND = 0.04  # of the longer side: how far a body reaches beyond its landmarks; the median of rendered people


def detect(paths: Sequence[str | os.PathLike[str]]) -> Detections:
    """The person in each image, a row each: MediaPipe's landmarks in pixels, and its world landmarks.

    MediaPipe finds one person an image, and nobody who is small in it: then it looks at parts of the image, and again
    around the largest person that it found there. ImportError without the extra; ValueError, naming the file, for a
    missing or unreadable image, one under 32 pixels, and one without a person.
    """
    with _model() as model:
        return join([_detections(path, *_landmarks(model, path, read(path))) for path in paths])


def detect_everyone(path: str | os.PathLike[str]) -> Detections:
    """All people in an image, a row each, the largest first: those that MediaPipe finds in the whole of it and in its
    parts. Raises as `detect`."""
    with _model() as model:
        pixels = read(path)
        people = _look_for_everyone(model, pixels) or [_landmarks(model, path, pixels)[:2]]
    size = (pixels.shape[1], pixels.shape[0])
    return join([_detections(path, *one, size) for one in people])


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
    height, width = pixels.shape[:2]
    found = _look(model, pixels, (0, 0, width, height)) or _look_at_parts(model, pixels)
    if found is None:
        raise ValueError(
            f"{path}: expected a person, found none; crop the image around one person whose feet are in it, or give "
            "keypoints of another detector (.json)"
        )
    return (*found, (width, height))


def _look_at_parts(model: Any, pixels: NDArray[np.uint8]) -> tuple[Array, Array] | None:
    """The largest person in overlapping parts of the image, of the largest parts that have one, looked at closely."""
    for share in PARTS:
        seen = _seen_in_parts(model, pixels, share)
        if seen:
            return _look_closely(model, pixels, max(seen, key=lambda one: _length(one, pixels)))
    return None


def _look_for_everyone(model: Any, pixels: NDArray[np.uint8]) -> list[tuple[Array, Array]]:
    """All people in the image and its parts, looked at closely, the tallest first; who is where another one is, is that
    one, and who is much smaller is left out."""
    height, width = pixels.shape[:2]
    whole = _look(model, pixels, (0, 0, width, height))
    seen = [] if whole is None else [whole]
    for share in PARTS:
        seen += _seen_in_parts(model, pixels, share)
    people: list[tuple[Array, Array]] = []
    for one in sorted(seen, key=lambda one: _length(one, pixels), reverse=True):
        if people and _length(one, pixels) < SMALL * _length(people[0], pixels):
            break  # faces in a crowd, and what is taken for people
        if not _is_among(one, people, pixels):
            one = _look_closely(model, pixels, one)
            people += [] if _is_among(one, people, pixels) else [one]
    return people


def _is_among(one: tuple[Array, Array], people: Sequence[tuple[Array, Array]], pixels: NDArray[np.uint8]) -> bool:
    """Whether what is seen of somebody is mostly nearer than a share of their size to what is of one of the people."""
    for other in people:
        apart = np.linalg.norm((one[0] - other[0])[:, :2] * pixels.shape[1::-1], axis=1)
        if _is_piece(one, other, pixels):
            return True
        both = np.minimum(one[0][:, 3], other[0][:, 3]) > SURE
        if both.any() and np.median(apart[both]) < SAME * max(_length(one, pixels), _length(other, pixels)):
            return True
    return False


def _is_piece(one: tuple[Array, Array], other: tuple[Array, Array], pixels: NDArray[np.uint8]) -> bool:
    """Whether somebody smaller lies mostly in the box of another: a piece of that person, seen as a whole one."""
    low, high = other[0][:, :2].min(axis=0), other[0][:, :2].max(axis=0)
    inside = ((one[0][:, :2] >= low) & (one[0][:, :2] <= high)).all(axis=1).mean()
    return bool(inside > PIECE and _length(one, pixels) < 0.8 * _length(other, pixels))


def _seen_in_parts(model: Any, pixels: NDArray[np.uint8], share: float) -> list[tuple[Array, Array]]:
    """Who is surely and wholly seen in overlapping parts of the image, each a share of its sides."""
    height, width = pixels.shape[:2]
    sides = max(int(share * width), SMALLEST), max(int(share * height), SMALLEST)
    boxes = [(x, y, *sides) for y in _steps(height, sides[1]) for x in _steps(width, sides[0])]
    seen = [(box, landmarks) for box in boxes if (landmarks := _look(model, pixels, box)) is not None]
    return [one for box, one in seen if np.median(one[0][:, 3]) > SURE and _is_whole(one, box, pixels)]


def _is_whole(one: tuple[Array, Array], box: tuple[int, int, int, int], pixels: NDArray[np.uint8]) -> bool:
    """Whether nearly all of somebody's landmarks lie in a box: outside it they are guessed."""
    points, low = one[0][:, :2] * pixels.shape[1::-1], np.array(box[:2])
    return float(((points >= low) & (points <= low + box[2:])).all(axis=1).mean()) >= WHOLE


def _look_closely(model: Any, pixels: NDArray[np.uint8], seen: tuple[Array, Array]) -> tuple[Array, Array]:
    """The person once more, in a box around them alone."""
    height, width = pixels.shape[:2]
    closer = _look(model, pixels, _around(seen[0], width, height))
    return seen if closer is None or not _is_among(closer, [seen], pixels) else closer


def _length(landmarks: tuple[Array, Array], pixels: NDArray[np.uint8]) -> float:
    """The longer side of a person's box in the image, pixels."""
    return float((np.ptp(landmarks[0][:, :2], axis=0) * pixels.shape[1::-1]).max())


def _steps(length: int, part: int) -> list[int]:
    """Where parts begin that overlap by half."""
    count = max(1, round(2 * (length - part) / part) + 1)
    return np.linspace(0, length - part, count).round().astype(int).tolist()


def _around(landmarks: Array, width: int, height: int) -> tuple[int, int, int, int]:
    """A box (x, y, width, height) in the image with room around a person."""
    points = landmarks[:, :2] * (width, height)
    low, high = points.min(axis=0), points.max(axis=0)
    margin = 0.3 * (high - low).max()
    x, y = np.maximum(low - margin, 0).astype(int).tolist()
    right, bottom = np.minimum(high + margin, (width, height)).astype(int).tolist()
    return x, y, max(right - x, SMALLEST), max(bottom - y, SMALLEST)


def _look(model: Any, pixels: NDArray[np.uint8], box: tuple[int, int, int, int]) -> tuple[Array, Array] | None:
    """MediaPipe's landmarks (33, 4) relative to the whole image, and its world landmarks, of a box in it."""
    x, y, width, height = box
    part = np.ascontiguousarray(pixels[y : y + height, x : x + width])
    with warnings.catch_warnings():
        warnings.filterwarnings("ignore", "SymbolDatabase.GetPrototype", UserWarning)  # between MediaPipe and protobuf
        result = model.process(part)
    if result.pose_landmarks is None:
        return None
    landmarks = _four(result.pose_landmarks)
    size = np.array([part.shape[1], part.shape[0]])
    landmarks[:, :2] = (landmarks[:, :2] * size + (x, y)) / (pixels.shape[1], pixels.shape[0])
    return landmarks, _four(result.pose_world_landmarks)


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
