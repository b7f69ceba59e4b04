"""Height -> pressure (Eq. 2) -> centre of pressure (Eq. 3)."""

from __future__ import annotations

import torch
from torch import Tensor

from ..ground import Ground
from .mass import weighted_mean
from .posed import Posed


def pressure_of_height(height: Tensor, alpha: float, gamma: float) -> Tensor:
    """(Eq. 2) ρ = 1 − αh below the ground, e^{−γh} on and above it (and its slope at 0).

    The inner choice prevents overflow.
    """
    below = height < 0
    return torch.where(below, 1 - alpha * height, torch.exp(-gamma * torch.where(below, 0, height)))


def pressure(body: Posed, ground: Ground, alpha: float = 100.0, gamma: float = 10.0) -> Tensor:
    """relative pressure of each sample (B, S)."""
    return pressure_of_height(ground.signed_height(body.samples), alpha, gamma)


def center_of_pressure(
    body: Posed,
    ground: Ground,
    alpha: float = 100.0,
    gamma: float = 10.0,
    epsilon: float = 0.0,
) -> Tensor:
    """(Eq. 3) Σ ρ v / (Σ ρ + ε): (B, 3), m.

    With ε = 0 a hovering body is lowered onto the ground first: where every point is above, that leaves the ratio as it
    is, and e^{−γh} cannot underflow to 0/0.
    """
    samples = body.samples
    height = ground.signed_height(samples)
    if epsilon == 0:
        lowest = height.detach().amin(dim=-1, keepdim=True).clamp(min=0)
        return weighted_mean(samples, pressure_of_height(height - lowest, alpha, gamma))
    weights = pressure_of_height(height, alpha, gamma)
    return (weights[..., None] * samples).sum(dim=-2) / (weights.sum(dim=-1, keepdim=True) + epsilon)
