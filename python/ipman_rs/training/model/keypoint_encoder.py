"""Keypoints to features, for a regressor that sees no image."""

from __future__ import annotations

from torch import Tensor, nn

from ipman_rs.data.keypoints import coco

KEYPOINTS = (*coco.NAMES, "left_big_toe", "right_big_toe", "left_heel", "right_heel")
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
