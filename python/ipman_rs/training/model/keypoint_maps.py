"""Loss on the small backbone's maps of keypoints. It teaches the backbone positions in the image, in place of
pretraining on ImageNet; from labels of bodies alone it would take many times as long."""

from __future__ import annotations

import torch
from torch import Tensor


def keypoint_maps_loss(maps: Tensor, keypoints: Tensor) -> Tensor:
    """Mean cross-entropy of the first K of the maps (B, M, h, w) of `Small.maps` against keypoints (B, K, 3).

    Keypoints: x and y in half sides of the crop, and confidence. The truth lies on the four cells around one, in
    bilinear shares.
    """
    maps = maps[:, : keypoints.shape[1]]
    rows, columns = _shares(keypoints[..., 1], maps.shape[2]), _shares(keypoints[..., 0], maps.shape[3])
    truth = rows[..., :, None] * columns[..., None, :]
    entropy = -(truth.flatten(2) * maps.flatten(2).log_softmax(dim=2)).sum(dim=2)
    return (keypoints[..., 2] * entropy).sum() / keypoints[..., 2].sum().clamp(min=1)


def _shares(places: Tensor, cells: int) -> Tensor:
    """(B, K, cells) of positions (B, K) from -1, the middle of the first cell, to 1, that of the last."""
    number = (0.5 * (places + 1) * (cells - 1)).clamp(0, cells - 1)
    return (1 - (number[..., None] - torch.arange(cells, device=places.device)).abs()).clamp(min=0)
