"""Estimates as bodies: surface, joints and the keypoints that images have labels of."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import torch
from torch import Tensor, nn

import ipman_rs.torch as ipt
from ipman_rs.fitting.landmarks import MIDPOINTS
from ipman_rs.fitting.surface import skin_points
from ipman_rs.torch.body import BodyOutput

from .model import Estimate


@dataclass(frozen=True)
class Posed:
    """In camera axes, m, where the body model puts them: vertices (B, V, 3), joints (B, J, 3), keypoints (B, K, 3)."""

    vertices: Tensor
    joints: Tensor
    keypoints: Tensor


class Posing(nn.Module):
    """A body model and the names of keypoints: joints, points of the skin, or midpoints, as in `fitting.landmarks`.

    ValueError for a keypoint that the body does not have.
    """

    ends: Tensor

    def __init__(self, body: ipt.BodyModel, keypoints: Sequence[str]):
        super().__init__()
        self.body, self.keypoints = body, tuple(keypoints)
        full = body.body
        rows = skin_points(full) | {name: full.num_vertices + j for j, name in enumerate(full.joint_names)}
        pairs = [MIDPOINTS.get(name, (name, name)) for name in self.keypoints]
        unknown = [name for pair in pairs for name in pair if name not in rows]
        if unknown:
            listed = ", ".join([*rows, *MIDPOINTS])
            raise ValueError(f"keypoints: the body {full.name!r} has no {unknown[0]!r}; it has {listed}")
        ends = torch.tensor([[rows[name] for name in pair] for pair in pairs], dtype=torch.int64).reshape(-1, 2)
        self.register_buffer("ends", ends, persistent=False)

    def forward(self, estimate: Estimate) -> Posed:
        # In half precision a body is off by centimetres.
        with torch.autocast(estimate.pose.device.type, enabled=False):
            posed = self.body(estimate.pose.float(), estimate.betas.float())
        return Posed(posed.vertices, posed.joints, self.points(posed))

    def points(self, posed: BodyOutput) -> Tensor:
        """The keypoints (B, K, 3) of posed bodies."""
        points = torch.cat([posed.vertices, posed.joints], dim=-2)
        return points[..., self.ends, :].mean(dim=-2)
