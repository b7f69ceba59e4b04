"""What a study of a fitted body has besides its measurements: camera, keypoints, and the body before the physics."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np

from .camera import Camera

if TYPE_CHECKING:
    from .study import Study


@dataclass(frozen=True)
class Fitted:
    """What a study of a fitted body knows more: its camera, its keypoints, the body before the physics terms.

    `camera` in pixels of the photo, whose width and height are `size`; `photo` its pixels (h, w, 3) uint8; `seen`
    (K, 3) x, y and confidence of the points that were detected, `projected` (K, 2) where the fitted body has them;
    `before` a study of one frame; `record` is shown in `report.json`.
    """

    camera: Camera
    size: tuple[float, float]
    seen: np.ndarray
    projected: np.ndarray
    photo: np.ndarray | None = None
    before: Study | None = None
    pictured: bool = True
    record: dict[str, Any] = field(default_factory=dict)

    def pictures(self) -> tuple[tuple[str, str], ...]:
        """File names of the pictures that the page shows, and their titles. The side view is half of the pair."""
        if not self.pictured:
            return ()
        over = "Over the photo" if self.photo is not None else "Over the keypoints"
        side = ("side.png", "From the side")
        if self.before is not None:
            side = ("before_after.png", "Before and after the physics terms, from the side")
        return ("overlay.png", over), side, ("floor.png", "The floor from above")


def camera_of(rotation: np.ndarray, translation: np.ndarray, focal: np.ndarray, center: np.ndarray) -> Camera:
    """The picture's camera of extrinsics R, t (x right, y down, z forward) and pixels."""
    axes = rotation * np.array([[1.0], [-1.0], [-1.0]])
    (fx, fy), (cx, cy) = focal, center
    return Camera(-rotation.T @ translation, axes, (float(fx), float(fy)), (float(cx), float(cy)))
