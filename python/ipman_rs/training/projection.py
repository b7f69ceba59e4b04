"""The weak-perspective camera of HMR and SPIN: three numbers that place a body in a crop."""

from __future__ import annotations

from torch import Tensor

FOCAL = 5000 / 112  # of the far away camera that stands for a weak perspective, in half sides of the crop (SPIN's)


def project(points: Tensor, camera: Tensor) -> Tensor:
    """Points (B, N, 3), m in camera axes, -> (B, N, 2) in half sides of the crop from its middle.

    camera (B, 3): scale, in half sides a metre, and the shift of the body in x and y, m, before it.
    """
    scale, shift = camera[:, :1], camera[:, None, 1:]
    depth = points[..., 2] + FOCAL / (scale + 1e-9)
    return FOCAL * (points[..., :2] + shift) / depth[..., None]
