"""A known camera from a JSON file: `{"R": [[…], […], […]], "t": […], "focal": 1100 or [fx, fy], "center": [cx, cy]}`.

R and t lead from the world (metres, y up) to the camera (x right, y down, z forward). In place of focal and center
there may be "K", the 3 × 3 matrix of OpenCV. What is left out is what `ipman fit` assumes without a file.
"""

from __future__ import annotations

import os
from dataclasses import dataclass
from typing import Any

import numpy as np

from ipman_rs.checks import LARGEST
from ipman_rs.files import read_json

Numbers = tuple[float, ...]
KEYS = ("R", "t", "focal", "center", "K")


@dataclass(frozen=True)
class KnownCamera:
    """Row-major numbers, so that two are equal when their cameras are."""

    rotation: Numbers | None = None  # 9
    translation: Numbers | None = None  # 3, m
    focal: Numbers | None = None  # 2, pixels
    center: Numbers | None = None  # 2, pixels


def read(path: str | os.PathLike[str]) -> KnownCamera:
    """Read a camera file. ValueError, naming file and key, if it does not describe a camera."""
    content = read_json(path)
    if not isinstance(content, dict) or not set(content) <= set(KEYS):
        raise ValueError(f"{path}: expected an object with some of {', '.join(KEYS)}, got {_short(content)}")

    def numbers(key: str, *shape: int) -> np.ndarray | None:
        if key not in content:
            return None
        try:
            array = np.asarray(content[key], dtype=np.float64)
        except (TypeError, ValueError, OverflowError):
            array = np.empty(0)
        if array.shape != shape or not (np.abs(array) <= LARGEST).all():
            wanted = " × ".join(map(str, shape))
            raise ValueError(f"{path}: {key}: expected {wanted} finite numbers, got {_short(content[key])}")
        return array

    rotation, translation = numbers("R", 3, 3), numbers("t", 3)
    matrix, center = numbers("K", 3, 3), numbers("center", 2)
    if rotation is not None and (np.abs(rotation @ rotation.T - np.eye(3)).max() > 1e-3 or np.linalg.det(rotation) < 0):
        raise ValueError(f"{path}: R: expected a rotation, got {_short(content['R'])}")
    focal = content.get("focal")
    is_number = isinstance(focal, (int, float)) and not isinstance(focal, bool)
    focal = np.full(2, focal, np.float64) if is_number else numbers("focal", 2)
    if matrix is not None:
        focal, center = matrix[[0, 1], [0, 1]], matrix[:2, 2]
    if focal is not None and not ((focal > 0) & (focal <= LARGEST)).all():
        raise ValueError(f"{path}: focal: expected positive pixels, got {_short(focal.tolist())}")
    arrays = (rotation, translation, focal, center)
    return KnownCamera(*(None if array is None else tuple(array.ravel().tolist()) for array in arrays))


def _short(value: Any) -> str:
    text = repr(value)
    return text if len(text) <= 60 else text[:57] + "..."
