"""Centre of mass: the paper's part-weighted one, its alternatives, and exact mass properties of the closed mesh."""

from __future__ import annotations

from collections.abc import Sequence

import torch
from torch import Tensor

from .closing_volume import ClosedParts, close_parts, part_volumes, six_volumes
from .posed import Posed


def center_of_mass(body: Posed, method: str = "pcom") -> Tensor:
    """(B, 3), m, by one of METHODS."""
    return METHODS[method](body)


def weighted_mean(points: Tensor, weights: Tensor) -> Tensor:
    """Σ w p / Σ w over (B, N, 3) and (B, N), about a held origin so that float32 keeps its digits far from home."""
    origin = points.detach().mean(dim=-2, keepdim=True)
    return (weights[..., None] * (points - origin)).sum(dim=-2) / weights.sum(dim=-1, keepdim=True) + origin[:, 0]


def safe_norm(vectors: Tensor) -> Tensor:
    """Euclidean length along the last axis, with gradient 0 instead of NaN at 0."""
    squared = (vectors * vectors).sum(dim=-1)
    positive = squared > 0
    return torch.where(positive, torch.where(positive, squared, 1).sqrt(), 0)


def _pcom(body: Posed) -> Tensor:
    """(Eq. 1) Σ vol(part(i)) v_i / Σ vol(part(i)) over the samples."""
    volume_of_sample = part_volumes(body).index_select(-1, body.mesh.sample_parts)
    return weighted_mean(body.samples, volume_of_sample)


def _vertex_mean(body: Posed) -> Tensor:
    return body.vertices.mean(dim=-2)


def _sample_mean(body: Posed) -> Tensor:
    return body.samples.mean(dim=-2)


def _face_area(body: Posed) -> Tensor:
    a, b, c = (body.vertices.index_select(-2, body.mesh.faces[:, k]) for k in range(3))
    return weighted_mean((a + b + c) / 3, safe_norm(torch.linalg.cross(b - a, c - a)) / 2)


def _exact(body: Posed) -> Tensor:
    parts = close_parts(body)
    volume, first = _volume_and_first_moment(parts)
    return first.sum(dim=1) / volume.sum(dim=1)[:, None] + parts.origin[:, 0]


METHODS = {
    "pcom": _pcom,
    "vertex_mean": _vertex_mean,
    "sample_mean": _sample_mean,
    "face_area": _face_area,
    "exact": _exact,
}


def mass_properties(body: Posed, density: Sequence[float] = (985.0,)) -> Tensor:
    """Volume, mass, centre (3), inertia about that centre (9, row-major): (B, P + 1, 14), row 0 the whole body.

    `density` holds one value for all parts or one a part, kg/m³.
    """
    parts = close_parts(body)
    per_part = body.vertices.new_tensor(tuple(density)).expand(body.template.num_parts)
    volume, first = _volume_and_first_moment(parts)
    second = _second_moment(parts)

    volume = torch.cat([volume.sum(dim=1, keepdim=True), volume], dim=1)
    mass, first, second = (
        torch.cat([weighted.sum(dim=1, keepdim=True), weighted], dim=1)
        for weighted in (
            volume[:, 1:] * per_part,
            first * per_part[:, None],
            second * per_part[:, None, None],
        )
    )
    center = first / mass[..., None]
    spread = second - mass[..., None, None] * center[..., :, None] * center[..., None, :]
    trace = spread.diagonal(dim1=-2, dim2=-1).sum(dim=-1)
    inertia = trace[..., None, None] * torch.eye(3).to(spread) - spread
    return torch.cat([volume[..., None], mass[..., None], center + parts.origin, inertia.flatten(start_dim=-2)], dim=-1)


def _volume_and_first_moment(parts: ClosedParts) -> tuple[Tensor, Tensor]:
    """∫ dV (B, P) and ∫ x dV (B, P, 3) over signed tetrahedra."""
    determinant = six_volumes(parts)
    first = determinant[..., None] * (parts.a + parts.b + parts.c) / 24
    return parts.sum_by_part(determinant / 6), parts.sum_by_part(first)


def _second_moment(parts: ClosedParts) -> Tensor:
    """∫ x xᵀ dV over signed tetrahedra: det/120 (s sᵀ + a aᵀ + b bᵀ + c cᵀ), s = a + b + c: (B, P, 3, 3)."""
    determinant = six_volumes(parts)
    corners = (parts.a, parts.b, parts.c, parts.a + parts.b + parts.c)
    outer = sum((x[..., :, None] * x[..., None, :] for x in corners), start=determinant.new_zeros(()))
    return parts.sum_by_part(determinant[..., None, None] * outer / 120)
