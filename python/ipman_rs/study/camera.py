"""A pinhole camera that looks at a body standing on its ground."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class ViewCamera:
    """Eye (3,), the axes right, up and back as rows (3, 3), focal length (or those of x and y) and centre in pixels."""

    eye: np.ndarray
    axes: np.ndarray
    focal: float | tuple[float, float]
    center: tuple[float, float]

    def pixels(self, points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Pixels (..., 2), y downwards, and the distance (...,) in front of the eye, of world points (..., 3)."""
        local = (points - self.eye) @ self.axes.T
        distance = np.maximum(-local[..., 2], 1e-6)
        fx, fy = np.broadcast_to(self.focal, 2)
        x = self.center[0] + fx * local[..., 0] / distance
        y = self.center[1] - fy * local[..., 1] / distance
        return np.stack([x, y], axis=-1), distance


def front_of(up: np.ndarray) -> np.ndarray:
    """(3,) where a body is taken to face: +z where y is up, -y where z is up, as body models do."""
    front = np.array([0.0, -1.0, 0.0]) if abs(up[2]) > 0.7 else np.array([0.0, 0.0, 1.0])
    front = front - (front @ up) * up
    return front / np.linalg.norm(front)


def look_at(
    points: np.ndarray,
    up: np.ndarray,
    box: tuple[float, float, float, float],
    turn: float = 35.0,
    tilt: float = 16.0,
    field: float = 26.0,
) -> ViewCamera:
    """The camera that just fits ``points`` (N, 3) into the pixel ``box`` (left, top, right, bottom).

    ``turn`` degrees around the up axis from the body's front, ``tilt`` degrees above the horizon, vertical field of
    view ``field`` degrees over the box.
    """
    front = front_of(up)
    side = np.cross(up, front)
    t, e = np.radians(turn), np.radians(tilt)
    back = np.cos(e) * (np.cos(t) * front + np.sin(t) * side) + np.sin(e) * up
    right = np.cross(up, back)
    right /= np.linalg.norm(right)
    axes = np.stack([right, np.cross(back, right), back])
    left, top, end, bottom = box
    focal = (bottom - top) / 2 / np.tan(np.radians(field) / 2)
    half = np.array([(end - left) / 2, (bottom - top) / 2]) / focal
    local = points @ axes.T
    # Each side of the view is a plane through the eye: the farthest-out point of each side places the eye.
    eye = np.empty(3)
    reach = np.empty(2)
    for k in (0, 1):
        plus = (local[:, k] + half[k] * local[:, 2]).max()
        minus = (-local[:, k] + half[k] * local[:, 2]).max()
        eye[k] = (plus - minus) / 2
        reach[k] = (plus + minus) / 2 / half[k]
    eye[2] = max(reach.max(), local[:, 2].max() + 1e-3)
    return ViewCamera(eye @ axes, axes, focal, ((left + end) / 2, (top + bottom) / 2))


def camera_of(rotation: np.ndarray, translation: np.ndarray, focal: np.ndarray, center: np.ndarray) -> ViewCamera:
    """The picture's camera of extrinsics R, t (x right, y down, z forward) and pixels."""
    axes = rotation * np.array([[1.0], [-1.0], [-1.0]])
    (fx, fy), (cx, cy) = focal, center
    return ViewCamera(-rotation.T @ translation, axes, (float(fx), float(fy)), (float(cx), float(cy)))
