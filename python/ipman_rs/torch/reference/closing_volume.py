"""Close each part through shared virtual vertices, and sum signed tetrahedra: the paper's vol^P (section 3.2)."""

from __future__ import annotations

from typing import NamedTuple

import torch
from torch import Tensor

from .posed import Posed
from .topology import Topology


class ClosedParts(NamedTuple):
    """Corners (B, T, 3) of the closed parts' triangles relative to `origin` (B, 1, 3), and how many each part has."""

    a: Tensor
    b: Tensor
    c: Tensor
    origin: Tensor
    part_sizes: tuple[int, ...]

    def sum_by_part(self, values: Tensor) -> Tensor:
        """Sum (B, T, ...) over each part's triangles: (B, P, ...)."""
        return torch.stack([part.sum(dim=1) for part in values.split(self.part_sizes, dim=1)], dim=1)


def close_parts(body: Posed) -> ClosedParts:
    """Triangles of the closed parts. The origin is held constant: closed integrals do not depend on where it lies."""
    mesh = body.mesh
    origin = body.vertices.detach().mean(dim=-2, keepdim=True)
    local = body.vertices - origin
    corners = torch.cat([local, virtual_vertices(local, mesh)], dim=-2)
    a, b, c = (corners.index_select(-2, mesh.triangles[:, corner]) for corner in range(3))
    return ClosedParts(a, b, c, origin, mesh.part_sizes)


def virtual_vertices(vertices: Tensor, mesh: Topology) -> Tensor:
    """The mean of each boundary component's vertices, each vertex once: (B, C, 3)."""
    ring = vertices.index_select(-2, mesh.ring_vertices)
    total = ring.new_zeros(ring.shape[0], len(mesh.ring_sizes), 3).index_add(-2, mesh.ring_components, ring)
    return total / mesh.ring_sizes[:, None].to(vertices.dtype)


def six_volumes(parts: ClosedParts) -> Tensor:
    """Six times the signed volume of each tetrahedron (origin, a, b, c): (B, T)."""
    return (torch.linalg.cross(parts.a, parts.b) * parts.c).sum(dim=-1)


def part_volumes(body: Posed) -> Tensor:
    """|signed volume| of each closed part: (B, P), m³."""
    parts = close_parts(body)
    return parts.sum_by_part(six_volumes(parts) / 6).abs()
