"""Keypoints to features, for the regressor of HMR."""

from __future__ import annotations

import torch
from torch import Tensor, nn

from ipman_rs.body import load_body

from ..model import HMR, MeanParameters
from .bodies import BODY
from .views import KEYPOINTS

WIDTH = 256


class KeypointEncoder(nn.Module):
    """Keypoints (B, K, 3) -> features (B, 256): a layer, and a residual block."""

    def __init__(self, count: int = len(KEYPOINTS)) -> None:
        super().__init__()
        self.first = nn.Linear(3 * count, WIDTH)
        self.block = nn.Sequential(nn.Linear(WIDTH, WIDTH), nn.ReLU(), nn.Linear(WIDTH, WIDTH))

    def forward(self, keypoints: Tensor) -> Tensor:
        features = self.first(keypoints.flatten(1)).relu()
        return (features + self.block(features)).relu()


def lifter(seed: int) -> HMR:
    """A regressor with the weights that a seed draws."""
    with torch.random.fork_rng(devices=[]):
        torch.manual_seed(seed)
        return HMR(KeypointEncoder(), WIDTH, MeanParameters.of(load_body(BODY)), hidden=WIDTH, dropout=0.0)
