"""The input of a fit: the body model, the observations of each body, ground and camera."""

from __future__ import annotations

from dataclasses import dataclass, fields, replace
from typing import TYPE_CHECKING, Any

from torch import Tensor

import ipman_rs.torch as ipt

from .camera import Camera

if TYPE_CHECKING:
    from .landmarks import Landmarks


@dataclass(frozen=True)
class Presented:
    """A pose that the person was shown and imitates: pose (B, J − 1, 3), and the root's rotation vector (B, 3) in the
    presented frame, none if None. contact: the vertices (n,) that touch in it, or whether each does, (B, V), where
    bodies are shown different poses; None where nothing touches."""

    pose: Tensor
    contact: Tensor | None = None
    orient: Tensor | None = None


@dataclass(frozen=True)
class Problem:
    """B bodies. Points that were not seen have confidence 0; their coordinates are any finite number."""

    body: ipt.BodyModel
    landmarks: Landmarks  # K named points of the body
    camera: Camera
    ground: ipt.Ground | None = None  # None: not known yet
    points: Tensor | None = None  # (B, K, 2) pixels
    confidence: Tensor | None = None  # (B, K), 0 to 1
    points_3d: Tensor | None = None  # (B, K, 3) m, in the world
    confidence_3d: Tensor | None = None  # (B, K)
    relative_points: Tensor | None = None  # (B, K, 3) m in the camera's axes, from an origin of their own
    relative_confidence: Tensor | None = None  # (B, K)
    feet_down: Tensor | None = None  # (B, 2) bool, left and right: their soles are on the ground; None: not asked for
    image_size: Tensor | None = None  # (B, 2) width and height, pixels
    height: Tensor | None = None  # (B,) m, of the person
    mass: Tensor | None = None  # (B,) kg
    presented: Presented | None = None
    static: Tensor | None = None  # (B,) bool: something holds it up, and it rests; None: not asked for
    image: Tensor | None = None  # (B,) int, which of the images: people of one share its pitch; None: one person each
    pitch_known: bool = True  # whether the camera's rotation tells where down is
    others_down: Tensor | None = None  # (B, 13) bool, of `support_points.OTHERS`, as `feet_down`; None: none of them
    on_floor: Tensor | None = None  # (B,) bool: more than feet may rest on the floor; None: of nobody
    seated: Tensor | None = None  # (B,) bool: a seat does, too; None: nobody sits

    @property
    def num_bodies(self) -> int:
        return len(self.camera.focal)

    def rows(self, index: Tensor) -> Problem:
        """The bodies of these indices, in this order; an index may come more than once."""
        return replace(self, **{field.name: _rows(getattr(self, field.name), index) for field in fields(self)})


def _rows(value: Any, index: Tensor) -> Any:
    if isinstance(value, Tensor):
        return value[index]
    if isinstance(value, Camera):
        return Camera(*(getattr(value, field.name)[index] for field in fields(value)))
    if isinstance(value, ipt.Ground):
        return (
            ipt.Ground.of_unit(value.normal.expand(-1, 3)[index], value.height[index]) if value.height.ndim else value
        )
    if isinstance(value, Presented):
        orient, contact = None if value.orient is None else value.orient[index], value.contact
        if contact is not None and contact.ndim == 2:
            contact = contact[index]
        return replace(value, pose=value.pose[index], orient=orient, contact=contact)
    return value
