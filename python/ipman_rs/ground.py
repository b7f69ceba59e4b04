"""The ground: a plane, h(u) = n·u − height and g(u) = u − h(u) n."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ipman_rs.checks import real_array


@dataclass(frozen=True, eq=False)
class Ground:
    """A ground plane, or one for each body of a batch.

    Args:
        normal: (3,) or (..., 3), any non-zero length; it points away from the ground and is normalised.
        height: metres along the unit normal, a scalar or (...,).

    Raises:
        ValueError: a normal is zero or not finite, or a height is not finite.
    """

    normal: NDArray[np.float64]
    height: NDArray[np.float64]

    def __init__(self, normal: ArrayLike = (0.0, 1.0, 0.0), height: ArrayLike = 0.0) -> None:
        with np.errstate(over="ignore"):  # what double precision cannot hold is refused as not finite
            directions = real_array("ground normal", normal).astype(np.float64)
            heights = real_array("ground height", height).astype(np.float64)
        if directions.ndim == 0 or directions.shape[-1] != 3:
            raise ValueError(f"ground normal: expected (3,) or (..., 3), got {directions.shape}")
        # Scaled first, so that neither tiny nor huge normals leave the range of squares.
        largest = np.abs(directions).max(axis=-1, keepdims=True)
        if not (np.isfinite(directions).all() and (largest > 0).all()):
            raise ValueError("ground normal: expected a finite direction that is not zero, such as (0, 1, 0)")
        if not np.isfinite(heights).all():
            raise ValueError("ground height: expected finite metres")
        scaled = directions / largest
        object.__setattr__(self, "normal", scaled / np.linalg.norm(scaled, axis=-1, keepdims=True))
        object.__setattr__(self, "height", heights)

    @classmethod
    def y_up(cls, height: ArrayLike = 0.0) -> Ground:
        """The floor of a world whose y axis points up."""
        return cls((0.0, 1.0, 0.0), height)

    @classmethod
    def z_up(cls, height: ArrayLike = 0.0) -> Ground:
        """The floor of a world whose z axis points up."""
        return cls((0.0, 0.0, 1.0), height)

    @classmethod
    def under(cls, vertices: ArrayLike, normal: ArrayLike = (0.0, 1.0, 0.0)) -> Ground:
        """The ground under the lowest vertex of each body: vertices (..., V, 3) m -> a ground for each of the batch.

        A body that is not finite has no lowest vertex, and a ground is finite: that body's lies at height 0.

        Args:
            normal: (3,) for all bodies or (..., 3) for each.

        Raises:
            ValueError: the normal is zero or not finite, or there are no vertices.
        """
        level = cls(normal)
        heights = level.signed_height(vertices)
        if heights.ndim == 0 or not heights.shape[-1]:
            raise ValueError(f"vertices: expected (..., V, 3) with V > 0, got {np.shape(vertices)}")
        lowest = np.where(np.isfinite(heights).all(axis=-1), heights.min(axis=-1), 0.0)
        return cls(np.broadcast_to(level.normal, (*lowest.shape, 3)), lowest)

    def signed_height(self, points: ArrayLike) -> NDArray[np.float64]:
        """h(u), metres above the ground. points (..., 3) for one ground, (..., N, 3) for one ground a body."""
        normal, height = self._beside_points()
        # Axis by axis: a sum along an axis of 3 takes many times as long.
        with np.errstate(over="ignore", invalid="ignore"):  # points near the end of the range have no finite height
            where = real_array("points", points).astype(np.float64, copy=False)
            x, y, z = (where[..., axis] * normal[..., axis] for axis in range(3))
            return x + y + z - height

    def project(self, points: ArrayLike) -> NDArray[np.float64]:
        """g(u), the points' feet on the ground, in the shape of `points` (see signed_height)."""
        normal, _ = self._beside_points()
        with np.errstate(over="ignore", invalid="ignore"):
            return real_array("points", points) - self.signed_height(points)[..., None] * normal

    def axes(self) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Two unit vectors in the plane, each (..., 3); (e1, e2, normal) is right-handed, e1 along x where possible."""
        along = np.where(np.abs(self.normal[..., :1]) < 0.9, (1.0, 0.0, 0.0), (0.0, 1.0, 0.0))
        first = along - (along * self.normal).sum(axis=-1, keepdims=True) * self.normal
        first = first / np.linalg.norm(first, axis=-1, keepdims=True)
        return first, np.cross(self.normal, first).astype(np.float64)

    def _beside_points(self) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        normal = self.normal if self.normal.ndim == 1 else self.normal[..., None, :]
        height = self.height if self.height.ndim == 0 else self.height[..., None]
        return normal, height


ANYWHERE = Ground()
"""For quantities that do not depend on the ground."""
