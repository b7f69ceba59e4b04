"""Where an image is taken from: X_c = R X + t (x right, y down, z forward), x = K X_c / z."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

Array = NDArray[np.floating]

FOCAL = (1.0, 2.5)  # sides of the image
ELEVATION = (-10.0, 60.0)  # degrees that the camera looks down
ROLL = 5.0  # degrees, standard deviation
EXTENT = (0.6, 0.88)  # of the image that the person spans
MARGIN = 0.03  # of the image, at its border
LOWEST_EYE = 0.15  # m
PASSES = 12


@dataclass(frozen=True)
class ImageCamera:
    """rotation (3, 3), translation (3,) m, intrinsics (3, 3) pixels of a square image of `size` pixels, float64."""

    size: int
    rotation: Array
    translation: Array
    intrinsics: Array

    @property
    def eye(self) -> Array:
        return -(self.rotation.T @ self.translation)

    def project(self, points: Array) -> Array:
        """World points (N, 3) -> pixels (N, 2) and depth (N,) as one array (N, 3)."""
        seen = rotate(points, self.rotation) + self.translation
        pixels = seen[:, :2] / seen[:, 2:] * self.intrinsics[[0, 1], [0, 1]] + self.intrinsics[:2, 2]
        return np.concatenate([pixels, seen[:, 2:]], axis=1)

    def rays(self, pixels: Array) -> Array:
        """Unit directions (N, 3) in the world through pixels (N, 2), in their precision."""
        intrinsics = self.intrinsics.astype(pixels.dtype)
        x, y = ((pixels[:, i] - intrinsics[i, 2]) / intrinsics[i, i] for i in (0, 1))
        length = np.sqrt(x * x + y * y + 1)
        return rotate(np.stack([x / length, y / length, 1 / length], axis=1), self.rotation.T)


def rotate(vectors: Array, rotation: Array) -> Array:
    """R v of vectors (N, 3), in their precision."""
    return np.stack([dot(vectors, row.astype(vectors.dtype)) for row in rotation], axis=1)


def dot(vectors: Array, others: Array) -> Array:
    """(N,) of vectors (N, 3) and (N, 3) or (3,), summed by hand: faster than over a short axis, and no matrix library's
    number of threads changes a bit."""
    (x, y, z), (u, v, w) = vectors.T, others.T
    return x * u + y * v + z * w


def draw_camera(draw: np.random.Generator, vertices: Array, size: int) -> ImageCamera:
    """A camera around a person (V, 3) that sees all of it, above the floor."""
    focal = size * draw.uniform(*FOCAL)
    turn, down, roll = draw.uniform(-180, 180), draw.uniform(*ELEVATION), draw.normal(0, ROLL)
    extent = size * draw.uniform(*EXTENT)
    play = draw.uniform(-1, 1, 2)
    middle = (vertices.min(axis=0) + vertices.max(axis=0)) / 2
    while True:
        rotation = view_rotation(turn, down, roll)
        camera = framing_camera(vertices - middle, rotation, focal, size, extent, play)
        camera = replace(camera, translation=camera.translation - rotate(middle[None], rotation)[0])
        if camera.eye[1] >= LOWEST_EYE:
            return camera
        down += 2.0


def view_rotation(turn: float, down: float, roll: float) -> Array:
    """World to camera, in degrees: looking along the world's -z, turned about the vertical, then down, then rolled."""
    upright = Rotation.from_euler("YXZ", [turn, -down, roll], degrees=True).as_matrix().T
    return np.diag([1.0, -1.0, -1.0]) @ upright


def framing_camera(points: Array, rotation: Array, focal: float, size: int, extent: float, play: Array) -> ImageCamera:
    """The camera that looks this way, so far off that the points (N, 3) span `extent` pixels, their middle moved by
    `play` (-1 to 1) times what the image has room for."""
    seen = rotate(points, rotation)
    shift = np.array([0.0, 0.0, focal / extent * np.ptp(seen[:, :2], axis=0).max() - seen[:, 2].min()])
    for _ in range(PASSES):
        flat = focal * (seen[:, :2] + shift[:2]) / (seen[:, 2:] + shift[2])
        low, high = flat.min(axis=0), flat.max(axis=0)
        wanted = play * (size * (1 - 2 * MARGIN) - (high - low)) / 2
        shift[:2] += (wanted - (low + high) / 2) * shift[2] / focal
        shift[2] *= (high - low).max() / extent
    return ImageCamera(size, rotation, shift, np.array([[focal, 0, size / 2], [0, focal, size / 2], [0, 0, 1.0]]))
