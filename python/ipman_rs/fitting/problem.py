"""What is known before a fit: the body model, what was observed of each body, and where ground and camera are."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from torch import Tensor

import ipman_rs.torch as ipt

from .camera import Camera

if TYPE_CHECKING:
    from .landmarks import Landmarks


@dataclass(frozen=True)
class Presented:
    """A pose that the person was shown and imitates: pose (B, J − 1, 3), and the vertices (n,) that touch in it."""

    pose: Tensor
    contact: Tensor | None = None


@dataclass(frozen=True)
class Problem:
    """B bodies. Points that were not seen have confidence 0; their coordinates are any finite number."""

    body: ipt.BodyModel
    landmarks: Landmarks  # K named points of the body
    camera: Camera
    ground: ipt.Ground
    points: Tensor | None = None  # (B, K, 2) pixels
    confidence: Tensor | None = None  # (B, K), 0 to 1
    points_3d: Tensor | None = None  # (B, K, 3) m, in the world
    confidence_3d: Tensor | None = None  # (B, K)
    image_size: Tensor | None = None  # (B, 2) width and height, pixels
    height: Tensor | None = None  # (B,) m, of the person
    mass: Tensor | None = None  # (B,) kg
    presented: Presented | None = None
