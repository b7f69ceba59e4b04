"""The balance cost: how implausible a redistribution of load over the existing supports balance would need.

    J = max_λ  λ·m − log Σ p_i e^{λ·x_i} − ½σ²|λ|²      (nats)

x_i ground position of sample i, m that of the CoM, p_i ∝ ρ_i. The maximiser is found by Newton's method without a
graph; one more, differentiable, Newton step there makes first and second derivatives exact.
"""

from __future__ import annotations

from typing import Any

import torch
from torch import Tensor

from ..folding import fold, unfold
from ..ground import Ground
from .mass import center_of_mass
from .posed import Posed
from .support import on_ground
from .topology import widest

NEWTON_STEPS = 100
HALVINGS = 40

WRAPS = {
    "log": torch.log1p,
    "saturate": lambda cost: cost / (1 + cost),
    "none": lambda cost: cost,
}


def balance_cost(
    body: Posed,
    ground: Ground,
    alpha: float = 100.0,
    gamma: float = 50.0,
    sigma: float = 0.02,
    wrap: str = "log",
    method: str = "pcom",
) -> Tensor:
    """(B,), nats, wrapped."""
    samples = body.samples
    log_load = torch.log_softmax(log_pressure(ground.signed_height(samples), alpha, gamma), dim=-1)
    offset = on_ground(samples - center_of_mass(body, method)[:, None], ground)

    optimum = torch.ops.ipman_rs.balance_multiplier(log_load.detach(), offset.detach(), sigma)
    gradient, hessian = _derivatives(log_load, offset, optimum, sigma)
    multiplier = optimum - _solve(hessian.detach(), gradient)
    return WRAPS[wrap](-_objective(log_load, offset, multiplier, sigma))


def log_pressure(height: Tensor, alpha: float, gamma: float) -> Tensor:
    """log ρ, without forming a ρ that could underflow."""
    return torch.where(height < 0, torch.log1p(-alpha * height.clamp(max=0)), -gamma * height)


def _objective(log_load: Tensor, offset: Tensor, multiplier: Tensor, sigma: float) -> Tensor:
    """F(λ) = log Σ p e^{λ·(x − m)} + ½σ²|λ|²: (B,)."""
    exponent = log_load + (offset * multiplier[:, None]).sum(dim=-1)
    return torch.logsumexp(exponent, dim=-1) + sigma**2 / 2 * (multiplier * multiplier).sum(dim=-1)


def _derivatives(log_load: Tensor, offset: Tensor, multiplier: Tensor, sigma: float) -> tuple[Tensor, Tensor]:
    """∂F/∂λ (B, 2) and ∂²F/∂λ² (B, 2, 2)."""
    load = torch.softmax(log_load + (offset * multiplier[:, None]).sum(dim=-1), dim=-1)
    mean = (load[..., None] * offset).sum(dim=-2)
    x, y = (offset - mean[:, None]).unbind(dim=-1)
    xx, xy, yy = ((load * product).sum(dim=-1) for product in (x * x, x * y, y * y))
    hessian = torch.stack([xx + sigma**2, xy, xy, yy + sigma**2], dim=-1).unflatten(-1, (2, 2))
    return mean + sigma**2 * multiplier, hessian


def _solve(matrix: Tensor, vector: Tensor) -> Tensor:
    """matrix⁻¹ vector for symmetric (B, 2, 2), (B, 2)."""
    a, b, d = matrix[:, 0, 0], matrix[:, 0, 1], matrix[:, 1, 1]
    x, y = vector.unbind(dim=-1)
    return torch.stack([d * x - b * y, a * y - b * x], dim=-1) / (a * d - b * b)[:, None]


def balance_multiplier(log_load: Tensor, offset: Tensor, sigma: float) -> Tensor:
    """The maximiser λ (B, 2), 1/m: log p (B, S), x − m (B, S, 2)."""
    log_load, offset = log_load.to(widest(offset.device)), offset.to(widest(offset.device))
    multiplier = torch.zeros_like(offset[:, 0])
    value = _objective(log_load, offset, multiplier, sigma)
    for _ in range(NEWTON_STEPS):
        gradient, hessian = _derivatives(log_load, offset, multiplier, sigma)
        step = -_solve(hessian, gradient)
        decrement = -(step * gradient).sum(dim=-1)
        if not bool((decrement > 1e-20).any()):
            break
        multiplier, value = _backtrack(log_load, offset, sigma, multiplier, value, step, decrement)
    return multiplier


def _backtrack(
    log_load: Tensor,
    offset: Tensor,
    sigma: float,
    multiplier: Tensor,
    value: Tensor,
    step: Tensor,
    decrement: Tensor,
) -> tuple[Tensor, Tensor]:
    """Halve each body's step until its objective falls enough; once rounding hides the fall, take the full step."""
    length = torch.ones_like(value)
    for _ in range(HALVINGS):
        trial = multiplier + length[:, None] * step
        reached = _objective(log_load, offset, trial, sigma)
        enough = (reached <= value - 1e-4 * length * decrement) | (decrement < 1e-12 * (1 + value.abs()))
        if bool(enough.all()):
            break
        length = torch.where(enough, length, length / 2)
    return trial, reached


_library = torch.library.Library("ipman_rs", "FRAGMENT")
_library.define(
    "balance_multiplier(Tensor log_load, Tensor offset, float sigma) -> Tensor", tags=(torch.Tag.pt2_compliant_tag,)
)


def _in_given_dtype(log_load: Tensor, offset: Tensor, sigma: float) -> Tensor:
    return balance_multiplier(log_load, offset, sigma).to(offset.dtype)


_library.impl("balance_multiplier", _in_given_dtype, "CompositeExplicitAutograd")


@torch.library.register_fake("ipman_rs::balance_multiplier", lib=_library)
def _(log_load: Tensor, offset: Tensor, sigma: float) -> Tensor:
    return offset.new_empty(offset.shape[0], 2)


def _batched(info: Any, in_dims: tuple[int | None, ...], *args: Any) -> tuple[Tensor, int]:
    multiplier = torch.ops.ipman_rs.balance_multiplier(*fold(info.batch_size, in_dims, args))
    return unfold(info.batch_size, multiplier), 0


torch.library.register_vmap("ipman_rs::balance_multiplier", _batched, lib=_library)
