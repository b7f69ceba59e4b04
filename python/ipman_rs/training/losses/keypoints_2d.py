"""Keypoints in the image, weighted by confidence."""

from __future__ import annotations

from torch import Tensor


def keypoints_2d_loss(projected: Tensor, keypoints: Tensor) -> Tensor:
    """Mean of c (x − x̂)² over all numbers of all people, labelled or not, as in SPIN.

    projected (B, K, 2), keypoints (B, K, 3) with confidence c, in half sides of the crop.
    """
    return (keypoints[..., 2:] * (projected - keypoints[..., :2]) ** 2).mean()
