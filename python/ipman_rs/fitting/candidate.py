"""Bodies at one point of an optimisation: each quantity is computed when a term first needs it, then cached."""

from __future__ import annotations

from collections.abc import Callable, Hashable, Sequence
from functools import cached_property
from typing import Any

import torch
from torch import Tensor

from ipman_rs.torch.body import BodyOutput

from .camera import Camera
from .landmarks import Landmarks
from .problem import Problem
from .rotations import matrix
from .variables import Variables, full_pose, pose_blocks


class Candidate:
    """B proposed bodies and cameras."""

    def __init__(self, problem: Problem, variables: Variables):
        self.problem = problem
        self.variables = variables
        self._shared: dict[Hashable, Any] = {}

    @cached_property
    def full_pose(self) -> Tensor:
        """(B, J, 3), the root first."""
        return full_pose(self.variables, self.problem.body.body)

    @property
    def expression(self) -> Tensor | None:
        """(B, E), None for bodies without a face that moves."""
        expression = self.variables.get("expression")
        return None if expression is None or expression.shape[1] == 0 else expression

    @cached_property
    def posed(self) -> BodyOutput:
        """The whole mesh, in the body's own precision: dearer than `landmarks`, which look at a few points of it."""
        dtype = self.problem.body.dtype
        given = (self.full_pose, self.variables["betas"], self.variables["transl"], self.expression)
        return self.problem.body(*(None if value is None else value.to(dtype) for value in given))

    @property
    def vertices(self) -> Tensor:
        """(B, V, 3) m, in the world."""
        return self.posed.vertices

    @cached_property
    def landmarks(self) -> Tensor:
        """(B, K, 3) m, in the world."""
        return self.points_of(self.problem.landmarks)

    def points_of(self, landmarks: Landmarks) -> Tensor:
        """Other named points (B, K, 3) m of the same body, in the world. Posed once."""
        variables = self.variables
        given = (variables["betas"], variables["transl"], self.expression)
        return self.shared(("points", landmarks), lambda: landmarks(self.full_pose, *given))

    def landmark_slopes(self, free: Sequence[str]) -> Tensor:
        """The landmarks' derivatives (B, P, K, 3) by the free blocks; 0 by those of the camera."""
        return self.slopes_of(self.problem.landmarks, free)

    def slopes_of(self, landmarks: Landmarks, free: Sequence[str]) -> Tensor:
        """The same of other named points of the body. Made once."""
        return self.shared(("slopes", landmarks, tuple(free)), lambda: self._slopes_of(landmarks, free))

    def _slopes_of(self, landmarks: Landmarks, free: Sequence[str]) -> Tensor:
        variables, body = self.variables, self.problem.body.body
        by_body = landmarks.jacobian(self.full_pose, variables["betas"], self.expression)
        zero, shape = by_body.new_zeros(()), by_body.shape[2:]
        sizes = [self.full_pose[0].numel(), variables["betas"].shape[1]]
        by_pose, by_betas, by_expression = by_body.tensor_split([sizes[0], sum(sizes)], dim=1)
        by_joint = pose_blocks(by_pose.unflatten(1, (-1, 3)), body)  # (B, joints, 3, K, 3), the root's (B, 3, K, 3)
        known = {"orient": by_joint["orient"]} | {name: by_joint[name].flatten(1, 2) for name in ("pose", "face")}
        by_transl = torch.eye(3, dtype=by_body.dtype)[:, None].expand(len(by_body), 3, *shape)
        known |= {"betas": by_betas, "expression": by_expression, "transl": by_transl}
        still = {name: zero.expand(len(by_body), variables[name][0].numel(), *shape) for name in free}
        return torch.cat([known.get(name, still[name]) for name in free], dim=1)

    @cached_property
    def camera(self) -> Camera:
        start, variables = self.problem.camera, self.variables
        return Camera(
            start.focal * variables["log_focal"].exp(),
            start.center,
            matrix(variables["camera_orient"]),
            variables["camera_transl"],
        )

    @cached_property
    def projected(self) -> Tensor:
        """The landmarks (B, K, 2), pixels."""
        return self.camera.project(self.landmarks)

    def shared(self, key: Hashable, make: Callable[[], Any]) -> Any:
        """What `make` returns, made once: for terms that look at the same quantity."""
        if key not in self._shared:
            self._shared[key] = make()
        return self._shared[key]
