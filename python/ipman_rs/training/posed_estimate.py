"""Estimates as posed bodies: surface, joints, and the keypoints for which images have labels."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import torch
from torch import Tensor, nn

import ipman_rs.torch as ipt
from ipman_rs.body import BodyModel
from ipman_rs.body.joint_regressors import EXTRA, JointRegressor
from ipman_rs.body.landmarks import ends, point_rows
from ipman_rs.torch.body import BodyOutput

from .model import Estimate

HIPS = (1, 2)  # of SMPL's joints
# Joints that other data sets label: SPIN's regressor makes them of vertices. Its hips are not SMPL's.
REGRESSED = tuple(f"{name}_regressed" for name in EXTRA)
REGRESSED_HIPS = (EXTRA.index("left_hip"), EXTRA.index("right_hip"))


@dataclass(frozen=True)
class Posed:
    """In camera axes, m, where the body model puts them: vertices (B, V, 3), joints (B, J, 3), keypoints (B, K, 3).
    regressed (B, R, 3): the joints `REGRESSED`, where there is a regressor."""

    vertices: Tensor
    joints: Tensor
    keypoints: Tensor
    regressed: Tensor | None = None

    def hips(self, regressed: Tensor) -> Tensor:
        """The middle of the hips (B, 3): of the regressor's where `regressed` (B,), else of the body's."""
        own = self.joints[:, HIPS].mean(dim=1)
        if self.regressed is None:
            return own
        return torch.where(regressed[:, None], self.regressed[:, REGRESSED_HIPS].mean(dim=1), own)

    @property
    def all_joints(self) -> Tensor:
        """(B, J + R, 3)."""
        return self.joints if self.regressed is None else torch.cat([self.joints, self.regressed], dim=1)


class Posing(nn.Module):
    """A body model and the names of keypoints: joints, points of the skin, or midpoints, as in `fitting.landmarks`.

    regressor: SPIN's `J_regressor_extra.npy`; keypoints may then be of `REGRESSED`, too. ValueError for a keypoint that
    the body does not have, and for another regressor or one of another mesh.
    """

    ends: Tensor
    weights: Tensor | None

    def __init__(self, body: ipt.BodyModel, keypoints: Sequence[str], regressor: JointRegressor | None = None):
        super().__init__()
        self.body, self.keypoints, self.regressor = body, tuple(keypoints), regressor
        full = body.body
        if regressor is not None:
            check_regressor(regressor, full)
        rows = point_rows(full)
        if regressor is not None:
            first = full.num_vertices + full.num_joints
            rows |= {name: first + k for k, name in enumerate(REGRESSED)}
        pairs = ends(self.keypoints, rows, full.name, "keypoints")
        both = torch.tensor([[rows[name] for name in pair] for pair in pairs], dtype=torch.int64).reshape(-1, 2)
        self.register_buffer("ends", both, persistent=False)
        weights = None if regressor is None else torch.from_numpy(regressor.weights).float()
        self.register_buffer("weights", weights, persistent=False)

    @property
    def hips(self) -> tuple[int, ...]:
        """The rows of `Posed.all_joints` that are hips: the body's, and the regressor's."""
        if self.weights is None:
            return HIPS
        return (*HIPS, *(self.body.body.num_joints + row for row in REGRESSED_HIPS))

    def forward(self, estimate: Estimate) -> Posed:
        # In half precision a body is off by centimetres.
        with torch.autocast(estimate.pose.device.type, enabled=False):
            posed = self.body(estimate.pose.float(), estimate.betas.float())
            regressed = self._regressed(posed.vertices)
        return Posed(posed.vertices, posed.joints, self.points(posed, regressed), regressed)

    def points(self, posed: BodyOutput, regressed: Tensor | None = None) -> Tensor:
        """The keypoints (B, K, 3) of posed bodies."""
        parts = [posed.vertices, posed.joints] if regressed is None else [posed.vertices, posed.joints, regressed]
        return torch.cat(parts, dim=-2)[..., self.ends, :].mean(dim=-2)

    def _regressed(self, vertices: Tensor) -> Tensor | None:
        return None if self.weights is None else torch.einsum("kv,bvc->bkc", self.weights, vertices)


def check_regressor(regressor: JointRegressor, body: BodyModel) -> None:
    """ValueError unless the regressor is SPIN's, for the body's mesh."""
    if regressor.names != EXTRA:
        raise ValueError(
            f"regressor: expected J_regressor_extra.npy with its {len(EXTRA)} joints, got one of {len(regressor.names)}"
        )
    count = regressor.weights.shape[1]
    if count != body.num_vertices:
        raise ValueError(f"regressor: is for {count} vertices, but the body {body.name!r} has {body.num_vertices}")
