"""The paper's ground loss (Eq. 5): pull what floats down to the floor (Eq. 6), push what sank out of it (Eq. 7)."""

from __future__ import annotations

import torch
from torch import Tensor

from ..ground import Ground
from .posed import Posed

CURVES = {
    "tanh_squared": lambda x: torch.tanh(x) ** 2,
    "tanh_of_square": lambda x: torch.tanh(x * x),
}


def ground_loss(
    body: Posed,
    ground: Ground,
    alpha1: float = 1.0,
    alpha2: float = 0.15,
    beta1: float = 10.0,
    beta2: float = 0.15,
    points: str = "samples",
    curve: str = "tanh_squared",
) -> tuple[Tensor, Tensor]:
    """pull (B,), push (B,): means over all points of α1 T(h/α2) (h >= 0), β1 T(h/β2) (h < 0)."""
    height = ground.signed_height(body.samples if points == "samples" else body.vertices)
    wave = CURVES[curve]
    # T(0) = 0 with slope 0, so clamping the other side away is the case distinction.
    pull = alpha1 * wave(height.clamp(min=0) / alpha2)
    push = beta1 * wave(height.clamp(max=0) / beta2)
    return pull.mean(dim=-1), push.mean(dim=-1)
