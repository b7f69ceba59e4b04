"""Bone directions: where each bone points, against the direction that a detector of 3D points has seen,

    Σ_bones (w c)² ρ² |d|² / (|d|² + ρ²)     d = b̂ − m̂

b̂ is the body's bone and m̂ the detected one, both of length 1 in the camera's axes, and c the lesser confidence of the
bone's two ends. Lengths and places are left out: detectors of one image know neither. They do know which end is nearer
to the camera, which the points in the image do not say: the mirrored bone has the same projection (Sminchisescu and
Triggs, *Kinematic jump processes for monocular 3D human tracking*, CVPR 2003). With ρ a bone that the detector has the
wrong way round stops pulling.
"""

from __future__ import annotations

from collections.abc import Sequence

import torch
from torch import Tensor

from ipman_rs.checks import positive

from ..candidate import Candidate
from ..problem import Problem
from .term import LeastSquares

_LIMBS = (
    ("shoulder", "elbow"), ("elbow", "wrist"), ("hip", "knee"), ("knee", "ankle"), ("heel", "big_toe"),
    ("hip", "shoulder"), ("ear", "nose"),
)  # fmt: skip
BONES = (
    *((f"{side}_{a}", b if b == "nose" else f"{side}_{b}") for a, b in _LIMBS for side in ("left", "right")),
    ("left_shoulder", "right_shoulder"), ("left_hip", "right_hip"),
)  # fmt: skip
SHORTEST = 1e-3  # m: a bone that is detected shorter than this points nowhere


class BoneDirections(LeastSquares):
    """rho: the length of a difference of two directions, 2 for opposite ones, at which a bone counts half."""

    def __init__(self, problem: Problem, rho: float = 0.3):
        super().__init__(problem)
        self.rho = positive("rho", rho, "numbers")
        names = problem.landmarks.names
        bones = [(names.index(a), names.index(b)) for a, b in BONES if a in names and b in names]
        self.starts, self.ends = ([bone[end] for bone in bones] for end in (0, 1))
        points, confidence = problem.relative_points, problem.relative_confidence
        if points is None or confidence is None:
            like = problem.camera.focal
            points, confidence = like.new_zeros(len(like), len(names), 3), like.new_zeros(len(like), len(names))
        bone = points[:, self.ends] - points[:, self.starts]
        length = _length(bone)
        seen = torch.minimum(confidence[:, self.starts], confidence[:, self.ends])
        self.weight = torch.where(length[..., 0] > SHORTEST, seen, 0)[..., None]
        self.directions = bone / length.clamp(min=SHORTEST)

    def residuals(self, candidate: Candidate) -> Tensor:
        bone = candidate.camera.turn(self._bones(candidate.landmarks)[:, None])[:, 0]
        difference = bone / _length(bone) - self.directions
        return (self.weight * self.rho * difference * self._soft(difference)).flatten(1)

    def linearised(self, candidate: Candidate, free: Sequence[str]) -> tuple[Tensor, Tensor] | None:
        """d's derivative is (1 − b̂b̂ᵀ) / |b| times the bone's; that of ρ d / √(|d|² + ρ²) has another share along d."""
        if "camera_orient" in free:
            return None
        bone = candidate.camera.turn(self._bones(candidate.landmarks)[:, None])[:, 0]
        length = _length(bone)
        direction = bone / length
        slopes = candidate.camera.turn(self._bones(candidate.landmark_slopes(free)))
        along = (slopes * direction[:, None]).sum(dim=-1, keepdim=True)
        slopes = (slopes - along * direction[:, None]) / length[:, None]
        difference = direction - self.directions
        soft = self._soft(difference)
        along = (slopes * difference[:, None]).sum(dim=-1, keepdim=True)
        slopes = slopes - along * (difference * soft**2)[:, None]
        weight = self.weight * self.rho * soft
        return (weight * difference).flatten(1), (weight[:, None] * slopes).flatten(2)

    def _bones(self, points: Tensor) -> Tensor:
        """The vectors (..., N, 3) along the bones from points (..., K, 3)."""
        return points[..., self.ends, :] - points[..., self.starts, :]

    def _soft(self, difference: Tensor) -> Tensor:
        return torch.rsqrt(difference.square().sum(dim=-1, keepdim=True) + self.rho**2)


def _length(vectors: Tensor) -> Tensor:
    """(..., 1)"""
    x, y, z = vectors.unbind(-1)
    return (x * x + y * y + z * z).sqrt()[..., None]
