"""Shape, pose and linear blend skinning: one class for the embedded body, SMPL, SMPL+H and SMPL-X."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike, NDArray

from . import rotations
from .hands import JOINTS_PER_HAND, Hands
from .parts import PART_NAMES, face_parts

if TYPE_CHECKING:
    from ..template import BodyTemplate

BODIES_AT_ONCE = 64  # a long sequence is skinned in pieces: the blended transforms take twelve numbers a vertex


@dataclass(frozen=True)
class BodyOutput:
    """`vertices` (..., V, 3) and `joints` (..., J, 3) of posed bodies, in metres."""

    vertices: NDArray[np.floating]
    joints: NDArray[np.floating]


@dataclass(frozen=True, eq=False, repr=False)
class BodyModel:
    """A body that shape and pose parameters move. Arrays are float64; V vertices, J joints, B betas, E expressions.

    Zero pose is SMPL's T-pose, Y up and facing +Z. The mesh may rest in another pose than that: then `rest_rotation`
    holds the world rotation of each joint that leads from the resting mesh to the zero pose (identity for SMPL
    files).
    """

    name: str
    v_template: NDArray[np.float64]  # (V, 3) m, the mean body at rest
    shapedirs: NDArray[np.float64]  # (V, 3, B) m per unit of beta
    expressiondirs: NDArray[np.float64]  # (V, 3, E), E may be 0
    posedirs: NDArray[np.float64] | None  # (V, 3, 9 (J - 1)) pose blend shapes
    J_template: NDArray[np.float64]  # (J, 3)
    J_shapedirs: NDArray[np.float64]  # (J, 3, B)
    J_expressiondirs: NDArray[np.float64]  # (J, 3, E)
    rest_rotation: NDArray[np.float64]  # (J, 3, 3)
    weights: NDArray[np.float64]  # (V, J), rows sum to 1
    faces: NDArray[np.int64]  # (F, 3)
    parents: NDArray[np.int64]  # (J,), -1 at the root; a parent comes before its children
    joint_names: tuple[str, ...]
    hands: Hands | None = None
    up: str = "y"

    part_names = PART_NAMES

    def __repr__(self) -> str:
        return (
            f"BodyModel({self.name!r}, {self.num_vertices} vertices, {self.num_joints} joints, {self.num_betas} betas)"
        )

    @property
    def num_vertices(self) -> int:
        return len(self.v_template)

    @property
    def num_joints(self) -> int:
        return len(self.parents)

    @property
    def num_betas(self) -> int:
        return self.shapedirs.shape[-1]

    @property
    def num_expressions(self) -> int:
        return self.expressiondirs.shape[-1]

    @cached_property
    def face_parts(self) -> NDArray[np.int64]:
        """Part index (F,) of every face in `part_names`."""
        return face_parts(self.faces, self.weights, self.joint_names)

    @cached_property
    def pose_mean(self) -> NDArray[np.float64]:
        """What is added to an axis-angle pose (J, 3): the mean of the hands, zero elsewhere."""
        mean = np.zeros((self.num_joints, 3))
        if self.hands is not None:
            mean[-2 * JOINTS_PER_HAND :] = self.hands.mean
        return mean

    @cached_property
    def template(self) -> BodyTemplate:
        """The mean body in its zero pose with its ten parts and 20,000 surface samples, ready for every quantity."""
        return self.make_template()

    def make_template(self, num_samples: int = 20_000, seed: int = 0) -> BodyTemplate:
        """A template like `.template` with another number of samples or another seed."""
        from ..template import BodyTemplate

        return BodyTemplate(
            self.forward().vertices, self.faces, self.face_parts, self.part_names, num_samples=num_samples, seed=seed
        )

    def forward(
        self,
        pose: ArrayLike | None = None,
        betas: ArrayLike | None = None,
        transl: ArrayLike | None = None,
        expression: ArrayLike | None = None,
    ) -> BodyOutput:
        """Posed bodies. Batch dimensions are free and broadcast against each other; what is None is zero.

        `pose` is (..., J, 3) axis-angle in radians or (..., J, 6) 6D (`rotations.from_6d`: first two columns), each
        joint relative to its parent, the root first. Axis-angle hands are relative to the mean hand (see `Hands`), 6D
        ones are absolute. `betas` (..., up to B), `expression` (..., up to E): missing components are zero. `transl`
        (..., 3) m. float32 in gives float32 out, anything else float64. Raises ValueError on a wrong shape.
        """
        given = [value for value in (pose, betas, transl, expression) if value is not None]
        dtype = np.float32 if given and np.result_type(*map(np.asarray, given)) == np.float32 else np.float64
        local = self._rotations(pose)
        shape = _components("betas", betas, self.num_betas)
        expressed = _components("expression", expression, self.num_expressions)
        shift = _components("transl", transl, 3, exact=True)

        batch = _common_batch(
            pose=local.shape[:-3], betas=shape.shape[:-1], transl=shift.shape[:-1], expression=expressed.shape[:-1]
        )
        local = np.broadcast_to(local, (*batch, self.num_joints, 3, 3)).reshape(-1, self.num_joints, 3, 3)
        shape, expressed, shift = (
            np.broadcast_to(value, (*batch, value.shape[-1])).reshape(len(local), value.shape[-1])
            for value in (shape, expressed, shift)
        )
        vertices = np.empty((len(local), self.num_vertices, 3), dtype)
        joints = np.empty((len(local), self.num_joints, 3), dtype)
        for start in range(0, len(local), BODIES_AT_ONCE):
            piece = slice(start, start + BODIES_AT_ONCE)
            posed = self._skin(local[piece], shape[piece], expressed[piece])
            vertices[piece], joints[piece] = (points + shift[piece, None] for points in posed)
        return BodyOutput(vertices.reshape(*batch, *vertices.shape[1:]), joints.reshape(*batch, *joints.shape[1:]))

    __call__ = forward

    def _rotations(self, pose: ArrayLike | None) -> NDArray[np.float64]:
        """Local rotation matrices (..., J, 3, 3) of a pose in either form."""
        array = np.zeros((self.num_joints, 3)) if pose is None else np.asarray(pose, float)
        if array.shape[-2:] == (self.num_joints, 3):
            return rotations.from_axis_angle(array + self.pose_mean)
        if array.shape[-2:] == (self.num_joints, 6):
            return rotations.from_6d(array)
        raise ValueError(
            f"pose: expected (..., {self.num_joints}, 3) axis-angle or (..., {self.num_joints}, 6) 6D for the body "
            f"{self.name!r}, got shape {array.shape}; reshape a flat pose with pose.reshape(..., {self.num_joints}, 3)"
        )

    def _skin(
        self, local: NDArray[np.float64], betas: NDArray[np.float64], expression: NDArray[np.float64]
    ) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Vertices (N, V, 3), joints (N, J, 3) of local rotations (N, J, 3, 3), betas (N, B), expression (N, E)."""
        count = len(local)
        rest = self.v_template + _blend(self.shapedirs, betas) + _blend(self.expressiondirs, expression)
        rest_joints = self.J_template + _blend(self.J_shapedirs, betas) + _blend(self.J_expressiondirs, expression)
        if self.posedirs is not None:
            rest = rest + _blend(self.posedirs, (local[:, 1:] - np.eye(3)).reshape(count, 9 * (self.num_joints - 1)))

        # Down the tree: `turned` takes a resting bone to the world.
        world = np.empty_like(local)
        joints = np.empty_like(rest_joints)
        turned = np.empty_like(local)
        for j, parent in enumerate(self.parents):
            if parent < 0:
                world[:, j], joints[:, j] = local[:, j], rest_joints[:, j]
            else:
                world[:, j] = world[:, parent] @ local[:, j]
                bone = (rest_joints[:, j] - rest_joints[:, parent])[..., None]
                joints[:, j] = joints[:, parent] + (turned[:, parent] @ bone)[..., 0]
            turned[:, j] = world[:, j] @ self.rest_rotation[j]

        offset = joints - (turned @ rest_joints[..., None])[..., 0]
        transforms = np.concatenate([turned, offset[..., None]], -1).reshape(count, self.num_joints, 12)
        blended = (self.weights @ transforms).reshape(count, self.num_vertices, 3, 4)
        return (blended[..., :3] @ rest[..., None])[..., 0] + blended[..., 3], joints


def _blend(directions: NDArray[np.float64], amounts: NDArray[np.float64]) -> NDArray[np.float64]:
    """sum_k amounts[n, k] directions[v, :, k] -> (N, V, 3)."""
    points, axes, count = directions.shape
    return (amounts @ directions.reshape(points * axes, count).T).reshape(len(amounts), points, axes)


def _components(name: str, value: ArrayLike | None, size: int, exact: bool = False) -> NDArray[np.float64]:
    """`value` (..., k) filled up with zeros to (..., size); None gives zeros. ValueError unless k fits."""
    if value is None:
        return np.zeros(size)
    array = np.asarray(value, float)
    count = array.shape[-1] if array.ndim else -1
    if not 0 <= count <= size or (exact and count != size):
        raise ValueError(f"{name}: expected shape (..., {'' if exact else 'up to '}{size}), got {array.shape}")
    return np.concatenate([array, np.zeros((*array.shape[:-1], size - count))], -1)


def _common_batch(**shapes: tuple[int, ...]) -> tuple[int, ...]:
    try:
        return np.broadcast_shapes(*shapes.values())
    except ValueError:
        listed = ", ".join(f"{name} {shape}" for name, shape in shapes.items())
        raise ValueError(f"batch dimensions do not fit together: {listed}") from None
