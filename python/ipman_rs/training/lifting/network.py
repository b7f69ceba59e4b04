"""Keypoints to features, for the regressor of HMR."""

from __future__ import annotations

import torch
from torch import Tensor, nn

from ipman_rs.body import load_body

from ...synthetic.population import BODY
from ..model import HMR, MeanParameters
from .views import KEYPOINTS

WIDTH = 256


class KeypointEncoder(nn.Module):
    """Keypoints (B, K, 3) -> features (B, width): a layer, and residual blocks."""

    def __init__(self, count: int = len(KEYPOINTS), width: int = WIDTH, blocks: int = 1) -> None:
        super().__init__()
        self.first = nn.Linear(3 * count, width)
        self.blocks = nn.ModuleList(
            nn.Sequential(nn.Linear(width, width), nn.ReLU(), nn.Linear(width, width)) for _ in range(blocks)
        )

    def forward(self, keypoints: Tensor) -> Tensor:
        features = self.first(keypoints.flatten(1)).relu()
        for block in self.blocks:
            features = (features + block(features)).relu()
        return features


def lifter(seed: int, body: str = BODY, width: int = WIDTH, blocks: int = 1) -> HMR:
    """A regressor of an embedded body with the weights that a seed draws."""
    with torch.random.fork_rng(devices=[]):
        torch.manual_seed(seed)
        encoder = KeypointEncoder(width=width, blocks=blocks)
        return HMR(encoder, width, MeanParameters.of(load_body(body)), hidden=WIDTH, dropout=0.0)
