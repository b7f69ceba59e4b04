"""What the small backbone may learn first: where in the image the keypoints are. It gets its positions from that, as a
large backbone gets its features from ImageNet; from labels of bodies alone it learns them many times slower."""

from __future__ import annotations

import torch
from torch import Tensor

from .backbones import Small


def keypoint_maps_loss(network: Small, images: Tensor, keypoints: Tensor) -> Tensor:
    """Mean cross-entropy of the first K maps of images (B, 3, H, W) against keypoints (B, K, 3), x and y in half sides
    of the crop and confidence. The truth lies on the four cells around a keypoint, in bilinear shares."""
    maps = network.maps(images)[0][:, : keypoints.shape[1]]
    truth = (
        _shares(keypoints[..., 1], maps.shape[2])[..., :, None]
        * _shares(keypoints[..., 0], maps.shape[3])[..., None, :]
    )
    entropy = -(truth.flatten(2) * maps.flatten(2).log_softmax(dim=2)).sum(dim=2)
    return (keypoints[..., 2] * entropy).sum() / keypoints[..., 2].sum().clamp(min=1)


def _shares(places: Tensor, cells: int) -> Tensor:
    """(B, K, cells) of positions (B, K) from -1, the middle of the first cell, to 1, that of the last."""
    number = (0.5 * (places + 1) * (cells - 1)).clamp(0, cells - 1)
    return (1 - (number[..., None] - torch.arange(cells, device=places.device)).abs()).clamp(min=0)
