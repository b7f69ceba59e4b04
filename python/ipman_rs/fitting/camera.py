"""Perspective cameras: x right, y down, z forward; R, t lead from the world to the camera."""

from __future__ import annotations

from dataclasses import dataclass

import torch
from torch import Tensor

from .rotations import matrix

NEAREST = 0.05  # m: points nearer, or behind the camera, are seen as if they were there


@dataclass(frozen=True)
class Camera:
    """Cameras of B images: focal (B, 2) and center (B, 2) in pixels, rotation (B, 3, 3), translation (B, 3) m."""

    focal: Tensor
    center: Tensor
    rotation: Tensor
    translation: Tensor

    def project(self, points: Tensor) -> Tensor:
        """World points (B, N, 3) -> pixels (B, N, 2)."""
        return self.image(self.see(points))

    def see(self, points: Tensor) -> Tensor:
        """World points (B, N, 3) in the camera's frame."""
        return self.turn(points[:, None])[:, 0] + self.translation[:, None]

    def turn(self, vectors: Tensor) -> Tensor:
        """Directions (B, P, N, 3) of the world in the camera's axes. Summed by hand, so that no batch size changes a
        bit."""
        x, y, z = vectors.unbind(-1)
        rows = self.rotation[:, None, None]
        return torch.stack([rows[..., i, 0] * x + rows[..., i, 1] * y + rows[..., i, 2] * z for i in range(3)], dim=-1)

    def image(self, seen: Tensor) -> Tensor:
        """Points (B, N, 3) in the camera's frame -> pixels (B, N, 2)."""
        depth = seen[..., 2:].clamp(min=NEAREST)
        return self.focal[:, None] * seen[..., :2] / depth + self.center[:, None]


def level_camera(pitch: float | Tensor = 0.0) -> Tensor:
    """R (3, 3) or (..., 3, 3) of a camera that looks along the world's −z, its x axis level; pitch in radians, positive
    looking down."""
    pitch = torch.as_tensor(pitch, dtype=torch.float64)
    facing = torch.diag(torch.tensor([1.0, -1.0, -1.0], dtype=torch.float64))
    zero = torch.zeros_like(pitch)
    return matrix(torch.stack([pitch, zero, zero], dim=-1)) @ facing
