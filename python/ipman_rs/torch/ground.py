"""The ground plane on tensors: n·u = height, one for the batch or one a body."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import torch
from torch import Tensor
from torch._C._functorch import is_functorch_wrapped_tensor

from ipman_rs import Ground as NumpyGround
from ipman_rs.checks import real_array

from .arrays import dense

Numbers = Tensor | np.ndarray | Sequence[float] | float


@dataclass(frozen=True, init=False, eq=False)
class Ground:
    """A plane: normal (3,) or (..., 3), made unit; height () or (...), m along the normal.

    Points u lie on it where normal·u = height. The leading dimensions broadcast against the bodies' batch dimensions.
    Stored in float64 on the CPU. On other devices a given tensor keeps its type and place.

    Raises:
        ValueError: wrong shape, a zero or non-finite normal, a non-finite height, or a tensor that requires grad: no
            quantity here is differentiable in its ground, and a silent zero gradient would mislead.
    """

    normal: Tensor
    height: Tensor

    def __init__(self, normal: Numbers = (0.0, 1.0, 0.0), height: Numbers = 0.0) -> None:
        direction, level = _tensor("normal", normal), _tensor("height", height)
        if direction.ndim == 0 or direction.shape[-1] != 3:
            raise ValueError(
                f"normal: expected shape (..., 3), got {tuple(direction.shape)}; pass one 3-vector a plane"
            )
        length = torch.linalg.vector_norm(direction, dim=-1, keepdim=True)
        if _is_concrete(direction) and not bool((length.isfinite() & (length > 0)).all()):
            raise ValueError("normal: expected finite, non-zero vectors; pass the ground's upward direction")
        if _is_concrete(level) and not bool(level.isfinite().all()):
            raise ValueError("height: expected finite numbers; pass the ground's height in metres along its normal")
        object.__setattr__(self, "normal", direction / length)
        object.__setattr__(self, "height", level)

    @classmethod
    def y_up(cls, height: Numbers = 0.0) -> Ground:
        """The plane y = height, y pointing up."""
        return cls((0.0, 1.0, 0.0), height)

    @classmethod
    def z_up(cls, height: Numbers = 0.0) -> Ground:
        """The plane z = height, z pointing up."""
        return cls((0.0, 0.0, 1.0), height)

    @classmethod
    def under(cls, vertices: Tensor, normal: Numbers = (0.0, 1.0, 0.0)) -> Ground:
        """The ground under the lowest vertex of each body: vertices (..., V, 3) m -> a ground for each of the batch.

        A body that is not finite has no lowest vertex, and a ground is finite: that body's lies at height 0. No
        gradient flows from the ground to the vertices.

        Args:
            normal: (3,) for all bodies or (..., 3) for each.

        Raises:
            ValueError: the normal is zero or not finite, or there are no vertices.
        """
        level = cls(normal)
        if vertices.ndim < 2 or vertices.shape[-1] != 3 or not vertices.shape[-2]:
            raise ValueError(f"vertices: expected (..., V, 3) with V > 0, got {tuple(vertices.shape)}")
        points = vertices.detach()
        heights = level.signed_height(points.double() if points.device.type == "cpu" else points)
        lowest = torch.where(heights.isfinite().all(dim=-1), heights.amin(dim=-1), 0.0)
        return cls.of_unit(level.normal.to(lowest).expand(*lowest.shape, 3), lowest)

    @classmethod
    def of_unit(cls, normal: Tensor, height: Tensor) -> Ground:
        """A ground from a unit normal and tensors known to be sound: nothing is checked or copied."""
        ground = object.__new__(cls)
        object.__setattr__(ground, "normal", normal)
        object.__setattr__(ground, "height", height)
        return ground

    def to(self, *args: Any, **kwargs: Any) -> Ground:
        """The same plane on another device or in another type, with the arguments of `Tensor.to`."""
        return Ground.of_unit(self.normal.to(*args, **kwargs), self.height.to(*args, **kwargs))

    def signed_height(self, points: Tensor) -> Tensor:
        """h(u), m above the ground: points (..., 3) for one ground, (..., N, 3) for one ground a body."""
        normal, height = self._beside(points)
        return (points * normal).sum(dim=-1) - height

    def project(self, points: Tensor) -> Tensor:
        """g(u), the points' feet on the ground, in the shape of points (see signed_height)."""
        normal, _ = self._beside(points)
        return points - self.signed_height(points)[..., None] * normal

    def flatten(self, vectors: Tensor) -> Tensor:
        """The component of one vector (..., 3) a ground that lies in the plane."""
        normal = self.normal.to(vectors)
        return vectors - (vectors * normal).sum(dim=-1, keepdim=True) * normal

    def axes(self) -> tuple[Tensor, Tensor]:
        """Two unit vectors in the plane, each (..., 3); (e1, e2, normal) is right-handed, e1 along x where possible."""
        x, y = self.normal.new_tensor([[1.0, 0.0, 0.0], [0.0, 1.0, 0.0]])
        along = torch.where(self.normal[..., :1].abs() < 0.9, x, y)
        first = along - (along * self.normal).sum(dim=-1, keepdim=True) * self.normal
        first = first / torch.linalg.vector_norm(first, dim=-1, keepdim=True)
        return first, torch.linalg.cross(self.normal, first)

    def _beside(self, points: Tensor) -> tuple[Tensor, Tensor]:
        """normal and height as they broadcast against points, in their dtype and place."""
        normal, height = self.normal.to(points), self.height.to(points)
        return (
            normal if normal.ndim == 1 else normal[..., None, :],
            height if height.ndim == 0 else height[..., None],
        )


def as_ground(ground: Ground | NumpyGround) -> Ground:
    """`ground` on tensors; a numpy ground is shared, not copied.

    Raises:
        TypeError: it is neither of the two ground classes.
    """
    if isinstance(ground, Ground):
        return ground
    if isinstance(ground, NumpyGround):
        return Ground.of_unit(torch.from_numpy(ground.normal), torch.from_numpy(ground.height))
    raise TypeError(f"ground: expected ipman_rs.torch.Ground or ipman_rs.Ground, got {type(ground).__name__}")


def as_numpy_ground(ground: Ground | NumpyGround) -> NumpyGround:
    """`ground` on arrays."""
    if isinstance(ground, NumpyGround):
        return ground
    plane = as_ground(ground)
    return NumpyGround(plane.normal.numpy(force=True), plane.height.numpy(force=True))


def _tensor(name: str, value: Numbers) -> Tensor:
    if isinstance(value, Tensor):
        dense(name, value, whole=True)
        if value.requires_grad or _has_tangent(value):
            raise ValueError(f"{name}: a ground that requires grad is not differentiable here; pass {name}.detach()")
        if value.device.type != "cpu" and value.is_floating_point():
            return value
        return value.to(torch.float64)
    with np.errstate(over="ignore"):  # what double precision cannot hold is refused as not finite
        return torch.as_tensor(real_array(name, value).astype(np.float64))


def _has_tangent(tensor: Tensor) -> bool:
    """Whether forward mode differentiates by it."""
    return not torch.compiler.is_compiling() and torch.autograd.forward_ad.unpack_dual(tensor).tangent is not None


def _is_concrete(tensor: Tensor) -> bool:
    """Whether its values can be read at no cost: not on a device, not while tracing or under vmap."""
    if torch.compiler.is_compiling() or tensor.device.type != "cpu":
        return False
    return not is_functorch_wrapped_tensor(tensor)
