"""The camera's scale must stay positive: a body behind the camera projects as well as one in front of it."""

from __future__ import annotations

from torch import Tensor


def positive_scale_loss(camera: Tensor) -> Tensor:
    """Mean of e^(−20 s) over cameras (B, 3), s the scale; SPIN's."""
    return (-20 * camera[:, 0]).exp().mean()
