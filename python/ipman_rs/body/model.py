"""Shape, pose and linear blend skinning: one class for the embedded body, SMPL, SMPL+H and SMPL-X."""

from __future__ import annotations

import itertools
import math
import weakref
from collections.abc import Mapping
from dataclasses import dataclass, field, fields
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ipman_rs import _core

from .hands import JOINTS_PER_HAND, Hands
from .parts import PART_NAMES, face_parts

if TYPE_CHECKING:
    from ..template import BodyTemplate

_Rows = NDArray[np.floating] | None

_KEYS = itertools.count()
_BY_KEY: weakref.WeakValueDictionary[int, BodyModel] = weakref.WeakValueDictionary()


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
    kind: str = ""  # what files call the parameters of such bodies: "smplx", or the name of an embedded one
    joint_parts: Mapping[str, str] = field(default_factory=dict)  # the body parts of joints whose names tell none
    _key: int = field(init=False, repr=False)

    part_names = PART_NAMES

    def __post_init__(self) -> None:
        object.__setattr__(self, "_key", next(_KEYS))
        object.__setattr__(self, "kind", self.kind or self.name)
        _BY_KEY[self._key] = self

    def __reduce__(self) -> tuple[Any, ...]:
        return BodyModel, tuple(getattr(self, given.name) for given in fields(self) if given.init)

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
        return face_parts(self.faces, self.weights, self.joint_names, self.joint_parts)

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
        dtype, batch, parameters = self._checked(pose, betas, transl, expression)
        count = math.prod(batch)
        vertices = np.empty((count, self.num_vertices, 3), dtype)
        joints = np.empty((count, self.num_joints, 3), dtype)
        self._skin(dtype).forward(count, parameters, vertices, joints)
        return BodyOutput(vertices.reshape(*batch, *vertices.shape[1:]), joints.reshape(*batch, *joints.shape[1:]))

    __call__ = forward

    def vertices_into(
        self,
        buffer: NDArray[np.floating] | None,
        pose: ArrayLike,
        betas: ArrayLike | None = None,
        transl: ArrayLike | None = None,
        expression: ArrayLike | None = None,
    ) -> NDArray[np.floating]:
        """The vertices of `forward` for poses (n, J, 3): in `buffer` (≥ n, V, 3) if it fits, else in a new array."""
        dtype, batch, parameters = self._checked(pose, betas, transl, expression)
        (count,) = batch
        if buffer is None or len(buffer) < count or buffer.dtype != dtype:
            buffer = np.empty((count, self.num_vertices, 3), dtype)
        joints = np.empty((count, self.num_joints, 3), dtype)
        self._skin(dtype).forward(count, parameters, buffer[:count], joints)
        return buffer[:count]

    def _checked(
        self,
        pose: ArrayLike | None,
        betas: ArrayLike | None,
        transl: ArrayLike | None,
        expression: ArrayLike | None,
    ) -> tuple[type[np.floating], tuple[int, ...], tuple[_Rows, _Rows, _Rows, _Rows]]:
        """The precision, the batch, and the four parameters as rows."""
        given = [value for value in (pose, betas, transl, expression) if value is not None]
        dtype = np.float32 if given and np.result_type(*map(np.asarray, given)) == np.float32 else np.float64
        arrays = {
            "pose": self._pose(pose, dtype),
            "betas": _components("betas", betas, self.num_betas, dtype),
            "expression": _components("expression", expression, self.num_expressions, dtype),
            "transl": _components("transl", transl, 3, dtype, exact=True),
        }
        tails = {name: 2 if name == "pose" else 1 for name in arrays}
        shapes = {name: array.shape[: -tails[name]] for name, array in arrays.items() if array is not None}
        batch = _common_batch(**shapes)
        given_pose, given_betas, given_expression, given_transl = (
            None if array is None else _rows(array, batch, tails[name]) for name, array in arrays.items()
        )
        return dtype, batch, (given_pose, given_betas, given_expression, given_transl)

    def _pose(self, pose: ArrayLike | None, dtype: type[np.floating]) -> NDArray[np.floating]:
        """A pose in either form, with at least the dimensions (J, 3) or (J, 6)."""
        array = np.zeros((self.num_joints, 3), dtype) if pose is None else np.asarray(pose, dtype)
        if array.shape[-2:] in ((self.num_joints, 3), (self.num_joints, 6)):
            return array
        raise ValueError(
            f"pose: expected (..., {self.num_joints}, 3) axis-angle or (..., {self.num_joints}, 6) 6D for the body "
            f"{self.name!r}, got shape {array.shape}; reshape a flat pose with pose.reshape(..., {self.num_joints}, 3)"
        )

    def _skin(self, dtype: type[np.floating]) -> _core.Skin:
        """The compiled form in one precision, made at its first use."""
        return self._single if dtype == np.float32 else self._double

    @cached_property
    def _single(self) -> _core.Skin:
        return self._compiled(single=True)

    @cached_property
    def _double(self) -> _core.Skin:
        return self._compiled(single=False)

    def _compiled(self, single: bool) -> _core.Skin:
        def plain(array: NDArray[np.floating]) -> NDArray[np.float64]:
            return np.require(array, np.float64, ["C", "A"])

        return _core.Skin(
            plain(self.v_template),
            plain(self.shapedirs),
            plain(self.expressiondirs),
            np.zeros(0) if self.posedirs is None else plain(self.posedirs),
            plain(self.J_template),
            plain(self.J_shapedirs),
            plain(self.J_expressiondirs),
            plain(self.rest_rotation),
            plain(self.pose_mean),
            plain(self.weights),
            np.require(self.parents, np.int64, ["C", "A"]),
            single,
        )


def by_key(key: int) -> BodyModel:
    """The living body with this `_key`: torch operators carry numbers, not objects."""
    try:
        return _BY_KEY[key]
    except KeyError:
        raise ValueError(f"body: number {key} does not live in this process (any more)") from None


def _rows(array: NDArray[np.floating], batch: tuple[int, ...], tail: int) -> NDArray[np.floating]:
    """An array as rows (count, ...), a single one if all bodies share it."""
    own, shape = array.shape[:-tail], array.shape[-tail:]
    if math.prod(own) != 1:
        array = np.broadcast_to(array, (*batch, *shape))
        own = batch
    return np.require(array.reshape(math.prod(own), *shape), requirements=["C", "A"])


def _components(
    name: str, value: ArrayLike | None, size: int, dtype: type[np.floating], exact: bool = False
) -> NDArray[np.floating] | None:
    """`value` (..., k), k up to size. ValueError unless k fits."""
    if value is None:
        return None
    array = np.asarray(value, dtype)
    count = array.shape[-1] if array.ndim else -1
    if not 0 <= count <= size or (exact and count != size):
        raise ValueError(f"{name}: expected shape (..., {'' if exact else 'up to '}{size}), got {array.shape}")
    return array


def _common_batch(**shapes: tuple[int, ...]) -> tuple[int, ...]:
    try:
        return np.broadcast_shapes(*shapes.values())
    except ValueError:
        listed = ", ".join(f"{name} {shape}" for name, shape in shapes.items())
        raise ValueError(f"batch dimensions do not fit together: {listed}") from None
