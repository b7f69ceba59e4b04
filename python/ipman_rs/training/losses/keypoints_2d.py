"""Keypoints in the image, weighted by confidence."""

from __future__ import annotations

from torch import Tensor


def keypoints_2d_loss(projected: Tensor, keypoints: Tensor, count: int = 0) -> Tensor:
    """Σ c |x − x̂|² / (2 count), a mean over all people, labelled or not, as in SPIN.

    projected (B, K, 2), keypoints (B, K, 3) with confidence c, in half sides of the crop. count: 0 for all K; SPIN's is
    49, 25 of them, OpenPose's, of weight 0.
    """
    squares = keypoints[..., 2:] * (projected - keypoints[..., :2]) ** 2
    return squares.mean() if count == 0 else squares.sum() / (2 * count * len(squares))
