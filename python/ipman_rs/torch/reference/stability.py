"""The paper's stability loss (Eq. 4): ‖g(CoM) − g(CoP)‖₂."""

from __future__ import annotations

from torch import Tensor

from ..ground import Ground
from .mass import center_of_mass, safe_norm
from .posed import Posed
from .pressure import center_of_pressure


def stability_loss(
    body: Posed,
    ground: Ground,
    alpha: float = 100.0,
    gamma: float = 10.0,
    epsilon: float = 0.0,
    method: str = "pcom",
) -> Tensor:
    """(B,), m; gradient 0 where the two points coincide."""
    mass = center_of_mass(body, method)
    pressure = center_of_pressure(body, ground, alpha, gamma, epsilon)
    return safe_norm(ground.flatten(mass - pressure))
