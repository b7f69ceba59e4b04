"""Self-contact by comparing every vertex with every face; winding numbers as sums of solid angles."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import torch
from torch import Tensor

if TYPE_CHECKING:
    from ipman_rs import BodyTemplate

INSIDE = 0.99
OPPOSITE = 0.5
FACING = 0.5
SIDE = 256  # vertices at a time


def self_contact_loss(
    vertices: Tensor,
    template: BodyTemplate,
    push_width: float = 0.04,
    pull_width: float = 0.005,
    pull_weight: float = 0.005,
    near: float = 0.02,
    geodesic: float = 0.3,
) -> tuple[Tensor, Tensor]:
    """(push, pull), each (B,), of vertices (B, V, 3), once differentiable."""
    faces = torch.as_tensor(template.faces.copy(), device=vertices.device)
    skipped = own_faces(template, geodesic).to(vertices.device)
    rows = []
    for given in vertices:
        finite = given.isfinite().all()
        body = torch.where(finite, given, 0)
        with torch.no_grad():
            inside, face, weights = _nearest_opposite(body, faces, skipped)
            normal = (_normals(body, faces)[faces[face]] * weights[..., None]).sum(dim=-2)
        nearest = (body[faces[face]] * weights[..., None]).sum(dim=-2)
        squared = (body - nearest).square().sum(dim=-1)
        distance = torch.where(squared > 0, squared, 1).sqrt() * (squared > 0)
        out = ((nearest - body) * normal).sum(dim=-1) >= FACING * normal.norm(dim=-1) * distance
        opposite = (face >= 0) & (out | ~inside)
        push = (distance / push_width).tanh().square() * (inside & opposite)
        pull = (distance / pull_width).tanh().square() * (~inside & opposite & (distance < near))
        both = torch.stack([0.5 * push.sum(), 0.5 * pull_weight * pull.sum()])
        rows.append(torch.where(finite, both, math.nan))
    both = torch.stack(rows) if rows else vertices.new_zeros(0, 2)
    return both[:, 0], both[:, 1]


def _normals(body: Tensor, faces: Tensor) -> Tensor:
    """Unit normals of the vertices: (V, 3)."""
    a, b, c = body[faces].unbind(dim=-2)
    areas = torch.linalg.cross(b - a, c - a).repeat_interleave(3, dim=0)
    return torch.nn.functional.normalize(torch.zeros_like(body).index_add(0, faces.flatten(), areas), eps=1e-300)


def own_faces(template: BodyTemplate, geodesic: float) -> Tensor:
    """Which faces are too near along the rest shape to be opposite to a vertex: (V, F) bool."""
    import numpy as np
    from scipy.sparse import coo_array
    from scipy.sparse.csgraph import dijkstra

    faces = template.faces
    edges = np.unique(np.sort(np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]])), axis=0)
    lengths = np.linalg.norm(template.vertices[edges[:, 0]] - template.vertices[edges[:, 1]], axis=1)
    graph = coo_array((lengths, (edges[:, 0], edges[:, 1])), shape=(template.num_vertices,) * 2).tocsr()
    within = dijkstra(graph, directed=False, limit=geodesic) <= geodesic
    return torch.from_numpy(within[:, faces].any(axis=-1))


def winding_angles(points: Tensor, vertices: Tensor, faces: Tensor) -> Tensor:
    """The part of each face (F) in the winding number at each point (P, 3): (P, F)."""
    a, b, c = ((vertices[faces[:, k]] - points[:, None]) for k in range(3))
    la, lb, lc = (x.norm(dim=-1) for x in (a, b, c))
    above = (a * torch.linalg.cross(b, c)).sum(dim=-1)
    beside = la * lb * lc + (a * b).sum(dim=-1) * lc + (b * c).sum(dim=-1) * la + (c * a).sum(dim=-1) * lb
    return torch.atan2(above, beside) / (2 * math.pi)


def _nearest_opposite(body: Tensor, faces: Tensor, skipped: Tensor) -> tuple[Tensor, Tensor, Tensor]:
    """Of each vertex: whether it is inside, its nearest opposite face (−1 without any), the weights there (V, 3)."""
    inside, face, weights = [], [], []
    for points, own in zip(body.split(SIDE), skipped.split(SIDE), strict=True):
        angles = winding_angles(points, body, faces)
        opposite = torch.where(own, 0, angles).sum(dim=-1)
        inside.append((angles.sum(dim=-1) > INSIDE) & (opposite > OPPOSITE))
        shares, squared = _closest(points, body[faces])
        best, index = torch.where(own, math.inf, squared).min(dim=-1)
        weights.append(shares[torch.arange(len(points), device=body.device), index])
        face.append(torch.where(best < math.inf, index, -1))
    return torch.cat(inside), torch.cat(face), torch.cat(weights)


def _closest(points: Tensor, triangles: Tensor) -> tuple[Tensor, Tensor]:
    """Weights (P, F, 3) of the nearest point of each triangle (F, 3, 3), and the squared distance (P, F)."""
    corners = triangles.unbind(dim=-2)
    normal = torch.linalg.cross(corners[1] - corners[0], corners[2] - corners[0])
    choices = []
    for k in range(3):  # the edges
        start, along = corners[k], corners[(k + 1) % 3] - corners[k]
        part = (((points[:, None] - start) * along).sum(dim=-1) / along.square().sum(dim=-1)).clamp(0, 1)
        shares = [torch.zeros_like(part)] * 3
        shares[k], shares[(k + 1) % 3] = 1 - part, part
        choices.append(torch.stack(shares, dim=-1))
    areas = []
    for k in range(3):
        edge, start = corners[(k + 2) % 3] - corners[(k + 1) % 3], corners[(k + 1) % 3]
        areas.append((normal * torch.linalg.cross(edge.expand(len(points), -1, -1), points[:, None] - start)).sum(-1))
    choices.append(torch.stack(areas, dim=-1) / normal.square().sum(dim=-1)[:, None])
    choices = torch.stack(choices)
    feet = sum(choices[..., k, None] * corners[k] for k in range(3))
    squared = (points[:, None] - feet).square().sum(dim=-1)
    squared[3] = torch.where((choices[3] >= 0).all(dim=-1), squared[3], math.inf)
    best, index = squared.min(dim=0)
    return choices.gather(0, index[None, ..., None].expand(1, -1, -1, 3))[0], best
