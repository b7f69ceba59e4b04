"""Stability, pull and push of a batch, and the gradient of their weighted sum, as a fixed chain of torch operations.

Coordinates are taken from a vertex of the body itself, so that a body far from the origin loses no digits. What is
summed over a body is summed in float64. Two passes over the samples suffice, both through scalars of the vertices:
heights W h give the pressures ρ and the loads Wᵀ ρ; levers W t give the slopes along the normal and their Wᵀ.
"""

from __future__ import annotations

from typing import NamedTuple

import torch
from torch import Tensor

from ..reference.topology import widest
from .sparse import product
from .tables import Tables

NUMBERS = ("stability", "pull", "push")
"""What is computed here and in the Triton kernels, in this order."""


class StabilityOptions(NamedTuple):
    """The options of the paper's terms, in their order."""

    alpha: float
    gamma: float
    epsilon: float
    alpha1: float
    alpha2: float
    beta1: float
    beta2: float


class Stage(NamedTuple):
    """What the gradient needs of the values' computation. Wide tensors are float64, the others as the vertices."""

    finite: Tensor  # (B,) bool
    points: Tensor  # (B, V, 3) from the body's origin
    normal: Tensor  # (B, 3)
    height: Tensor  # (B, S) of the samples
    density: Tensor  # (B, S)
    load: Tensor  # (B, V): Wᵀ ρ
    total: Tensor  # (B,) wide: Σ ρ + ε
    cop: Tensor  # (B, 3) wide
    area: Tensor  # (B, T, 3): each triangle's normal, twice its area long
    volume: Tensor  # (B, P) wide, signed
    sums: Tensor  # (B, P, 3) wide: the samples of each part
    com: Tensor  # (B, 3) wide
    offset: Tensor  # (B, 3) wide: com − cop along the ground
    length: Tensor  # (B,) wide


def values(tables: Tables, o: StabilityOptions, curve: str, vertices: Tensor, normal: Tensor, height: Tensor) -> Tensor:
    """(B, 3): stability, pull, push; NaN if a vertex is not finite. vertices (B, V, 3), normal (B, 3), height (B,)."""
    return _values(tables, o, curve, vertices, normal, height)[0]


def values_and_gradient(
    tables: Tables, o: StabilityOptions, curve: str, vertices: Tensor, normal: Tensor, height: Tensor, weights: Tensor
) -> tuple[Tensor, Tensor]:
    """Values (B, 3), and the gradient (B, V, 3) of Σ weights (B, 3) · values; 0 for a body that is not finite."""
    terms, stage = _values(tables, o, curve, vertices, normal, height)
    return terms, _gradient(tables, o, curve, stage, weights)


def _values(
    tables: Tables, o: StabilityOptions, curve: str, vertices: Tensor, normal: Tensor, height: Tensor
) -> tuple[Tensor, Stage]:
    wide = widest(vertices.device)
    finite = vertices.isfinite().flatten(1).all(dim=1)
    vertices = torch.where(finite[:, None, None], vertices, tables.rest)
    normal, height = normal.to(wide), height.to(wide)
    origin = vertices[:, tables.origin]
    points = vertices - origin[:, None]
    narrow = normal.to(points.dtype)

    above = (normal * origin.to(wide)).sum(dim=-1) - height
    # The steep pressure curve multiplies rounding by α: heights are small near the ground, if formed in float64.
    at_vertices = ((points.to(wide) * normal[:, None]).sum(dim=-1) + above[:, None]).to(points.dtype)
    at_samples = product(tables.samples, at_vertices, points.dtype)
    density = _density(o, at_samples)
    load = product(tables.samples_back, density, points.dtype)
    total = density.sum(dim=-1, dtype=wide) + o.epsilon
    moment = (load[..., None] * points).sum(dim=1, dtype=wide)
    # (Eq. 3)
    cop = (moment - o.epsilon * origin.to(wide)) / total[:, None]  # ε pulls towards the world's origin

    a, b, c = _corners(tables, points).unbind(dim=1)
    area = torch.linalg.cross(b - a, c - a)
    volume = product(tables.parts, (a * area).sum(dim=-1), wide) / 6
    sums = product(tables.sample_sums, points, wide)
    # (Eq. 1)
    com = (volume.abs()[..., None] * sums).sum(dim=1) / _weight(tables, volume)[:, None]

    # (Eq. 4)
    offset = com - cop
    offset = offset - (offset * normal).sum(dim=-1, keepdim=True) * normal
    length = (offset * offset).sum(dim=-1).sqrt()  # differentiated by hand: no trouble at 0

    # (Eq. 6) and (Eq. 7)
    pull = o.alpha1 * _wave(curve, at_samples.clamp(min=0) / o.alpha2)[0].mean(dim=-1, dtype=wide)
    push = o.beta1 * _wave(curve, at_samples.clamp(max=0) / o.beta2)[0].mean(dim=-1, dtype=wide)
    terms = torch.stack([length, pull, push], dim=-1).to(points.dtype)
    terms = torch.where(finite[:, None], terms, torch.nan)
    return terms, Stage(
        finite, points, narrow, at_samples, density, load, total, cop, area, volume, sums, com, offset, length
    )


def _gradient(tables: Tables, o: StabilityOptions, curve: str, s: Stage, weights: Tensor) -> Tensor:
    dtype, wide = s.points.dtype, s.total.dtype
    # 0 where the two points coincide.
    unit = s.offset / torch.where(s.length > 0, s.length, 1)[:, None]
    d_com = weights[:, :1].to(wide) * unit

    # s̄: by v_i it is ρ_i / Σρ, by ρ_i it is (v_i − s̄) / Σρ; stability pulls it the other way than the centre of mass.
    d_cop = (-d_com / s.total[:, None]).to(dtype)
    lever = ((s.points - s.cop.to(dtype)[:, None]) * d_cop[:, None]).sum(dim=-1)
    density_slope = torch.where(s.height < 0, -o.alpha, -o.gamma * s.density)
    samples = s.height.shape[1]
    pull = _wave(curve, s.height.clamp(min=0) / o.alpha2)[1] * (weights[:, 1:2] * (o.alpha1 / o.alpha2 / samples))
    push = _wave(curve, s.height.clamp(max=0) / o.beta2)[1] * (weights[:, 2:3] * (o.beta1 / o.beta2 / samples))
    d_height = product(tables.samples_back, density_slope * product(tables.samples, lever, dtype) + pull + push, dtype)

    # m̄ = Σ_p |vol_p| sums_p / Σ_p |vol_p| n_p: by the samples, and by the volumes, whose gradient at a vertex is a
    # sixth of the area normals around it, for each part is closed.
    weight = _weight(tables, s.volume)[:, None]
    share = product(tables.sample_sums_back, (s.volume.abs() / weight).to(dtype), dtype)
    arm = s.sums - tables.part_sizes.to(wide)[:, None] * s.com[:, None]
    d_volume = s.volume.sign() * (arm * d_com[:, None]).sum(dim=-1) / weight / 6
    of_triangle = d_volume.to(dtype).index_select(1, tables.triangle_parts)
    at_corners = product(tables.incidence, s.area * of_triangle[..., None], dtype)
    real = s.points.shape[1]
    gradient = at_corners[:, :real]
    if at_corners.shape[1] > real:
        gradient = gradient + product(tables.centres_back, at_corners[:, real:], dtype)

    gradient = gradient + share[..., None] * d_com.to(dtype)[:, None] + s.load[..., None] * d_cop[:, None]
    gradient = gradient + d_height[..., None] * s.normal[:, None]
    return torch.where(s.finite[:, None, None], gradient, 0)


def _corners(tables: Tables, points: Tensor) -> Tensor:
    """The triangles' corners, virtual ones included: (B, 3, T, 3)."""
    every = torch.cat([points, product(tables.centres, points, points.dtype)], dim=1)
    return every.index_select(1, tables.corners).reshape(len(every), 3, len(tables.triangle_parts), 3)


def _weight(tables: Tables, volume: Tensor) -> Tensor:
    """Σ_p |vol_p| n_p: (B,)."""
    return (volume.abs() * tables.part_sizes.to(volume.dtype)).sum(dim=-1)


def _density(o: StabilityOptions, height: Tensor) -> Tensor:
    """ρ (Eq. 2); without ε a hovering body is first lowered onto the ground, which leaves its centre as it is."""
    if o.epsilon == 0:
        height = height - height.amin(dim=-1, keepdim=True).clamp(min=0)
    return torch.where(height < 0, 1 - o.alpha * height, torch.exp(-o.gamma * height.clamp(min=0)))


def _wave(curve: str, x: Tensor) -> tuple[Tensor, Tensor]:
    """T(x), "tanh_squared" (tanh x)² or "tanh_of_square" tanh(x²), and dT/dx."""
    if curve == "tanh_squared":
        t = torch.tanh(x)
        return t * t, 2 * t * (1 - t * t)
    t = torch.tanh(x * x)
    return t, 2 * x * (1 - t * t)
