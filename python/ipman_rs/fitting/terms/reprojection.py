"""2D reprojection: how far the projected landmarks are from the points seen in the image, with the Geman-McClure cost

    Σ_k (w_k c_k)² ρ² e² / (e² + ρ²)     of each coordinate's error e in pixels of an image 500 pixels high

so that a point that was detected elsewhere (e ≫ ρ) stops pulling. Weight 1 is a mean of squares near zero error.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import torch
from torch import Tensor

from ..camera import NEAREST
from ..candidate import Candidate
from ..landmarks import HAND_POINTS
from ..problem import Problem
from ..rotations import left_jacobian
from .term import LeastSquares

HEIGHT = 500.0


class Reprojection(LeastSquares):
    """rho: pixels of an image 500 pixels high. weights: of landmarks by name, 1 where nothing is said. hands: that of
    the points of the hands (`landmarks.HAND_POINTS`), the wrists not among them."""

    def __init__(
        self, problem: Problem, rho: float = 100.0, weights: Mapping[str, float] | None = None, hands: float = 1.0
    ):
        super().__init__(problem)
        if problem.points is None or problem.confidence is None or problem.image_size is None:
            raise ValueError("reprojection: expected points in an image, got none")
        self.rho = rho
        names = problem.landmarks.names
        self.points = problem.points
        self.scale = (HEIGHT / problem.image_size[:, 1])[:, None, None]
        usual = {**dict.fromkeys(HAND_POINTS, hands), **(weights or {})}
        weight = torch.tensor([usual.get(name, 1.0) for name in names], dtype=self.points.dtype)
        self.weight = (weight * problem.confidence)[..., None]

    def residuals(self, candidate: Candidate) -> Tensor:
        error = (candidate.projected - self.points) * self.scale
        return (self.weight * self.rho * error * (error.square() + self.rho**2).rsqrt()).flatten(1)

    def linearised(self, candidate: Candidate, free: Sequence[str]) -> tuple[Tensor, Tensor]:
        """Residual by error by pixel by place in the camera's frame by the free blocks, each link by hand."""
        camera = candidate.camera
        seen = camera.see(candidate.landmarks)
        depth = seen[..., 2:].clamp(min=NEAREST)
        flat = seen[..., :2] / depth
        error = (camera.focal[:, None] * flat + camera.center[:, None] - self.points) * self.scale
        soft = (error.square() + self.rho**2).rsqrt()
        by_pixel = self.weight * self.scale * (self.rho * soft) ** 3
        moved = _moved(candidate, seen, free)
        in_front = (seen[..., 2:] > NEAREST).to(moved.dtype)
        by_place = camera.focal[:, None] / depth * by_pixel
        slope = by_place[:, None] * (moved[..., :2] - (flat * in_front)[:, None] * moved[..., 2:])
        if "log_focal" in free:
            start = sum(candidate.variables[name][0].numel() for name in free[: free.index("log_focal")])
            for axis in range(2):
                slope[:, start + axis, :, axis] = (by_pixel * camera.focal[:, None] * flat)[..., axis]
        return (self.weight * self.rho * error * soft).flatten(1), slope.flatten(2)


def _moved(candidate: Candidate, seen: Tensor, free: Sequence[str]) -> Tensor:
    """How the landmarks (B, K, 3) move in the camera's frame with each free number, (B, P, K, 3)."""
    camera, variables = candidate.camera, candidate.variables
    moved = camera.turn(candidate.landmark_slopes(free)).clone()
    start = 0
    for name in free:
        size = variables[name][0].numel()
        if name == "camera_transl":
            moved[:, start : start + 3] = torch.eye(3, dtype=seen.dtype)[:, None]
        elif name == "camera_orient":
            turned = seen - camera.translation[:, None]
            axes = left_jacobian(variables[name])
            for axis in range(3):
                turn = axes[:, None, :, axis].expand_as(turned)
                moved[:, start + axis] = torch.linalg.cross(turn, turned)
        start += size
    return moved
