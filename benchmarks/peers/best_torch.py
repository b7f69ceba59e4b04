"""(c) The best torch we could write: what patience with torch.compile reaches without leaving Python.

- The gradient is written out by hand: what the samples need to know of the whole body is a handful of sums, so two
  passes over the samples do it, and little is kept between forward and backward.
- The batch is the last dimension, so that inductor's vector lanes hold bodies; at B = 1 they hold samples.
- Nothing is scattered: W, Wᵀ and the rings of the vertices are tables of indices, rows of one width together, and every
  output gathers what it needs.
- The ring of a vertex gives volume and gradient at once: G = ∂vol/∂v = Σ (rⱼ − v) × (rⱼ₊₁ − v) / 6, vol = Σ v · G / 3.
  The virtual vertices that close the parts have rings like any other.

It is float32 throughout and takes y = 0 for the ground. Nothing is guarded: no status of bodies, no NaN, no hovering.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

import numpy as np
import torch
from numpy.typing import ArrayLike, NDArray
from torch import Tensor

from ipman_rs import BodyTemplate, presets
from ipman_rs.torch.reference.topology import topology

ROW_WIDTHS = (1, 2, 3, 4, 6, 8)
"""Rows of a sparse matrix are filled up to the next of these; longer rows are cut into pieces, added up after."""

PIECE_WIDTHS = (1, 2, 4, 8, 16)
"""How many pieces a row has, filled up."""

RING_WIDTHS = (5, 6, 7, 8, 10)
"""The same for rings; longer ones stand together and are summed by a loop."""


Row = list[tuple[int, float]]
"""(column, weight) of a sparse row."""


class Group(NamedTuple):
    """Sparse rows of one width: `indices` (rows, width) int64, `weights` (rows, width)."""

    indices: Tensor
    weights: Tensor


class Table(NamedTuple):
    """A sparse matrix: `pieces` of its rows, then the `rows` that are sums of pieces, then the `place` of each row."""

    pieces: tuple[Group, ...]
    rows: tuple[Group, ...]
    place: Tensor


class Fixed(NamedTuple):
    """All that depends on the template alone. P parts, R rings, C virtual vertices.

    samples: W. spread: Wᵀ. lids: the means that the virtual vertices are, (C, V).
    rings: the points around each vertex of each part, groups of (rows, 1 + width) whose first column is the vertex.
    unite: from rings to the mesh's vertices, (V, R): a vertex takes its own rings and its share of its lid's.
    part_of_ring (R,). in_part: (P, R), 1/3 where the ring is of the part.
    part_sums: (P, V), what the samples of a part add up to. part_counts (P, 1).
    """

    samples: Group
    spread: Table
    lids: Table
    rings: tuple[Tensor, ...]
    unite: Table
    part_of_ring: Tensor
    in_part: Tensor
    part_sums: Tensor
    part_counts: Tensor


class Kept(NamedTuple):
    """What the second pass needs of the first: columns are bodies."""

    height: Tensor  # (S, B)
    load: Tensor  # Wᵀρ (V, B)
    normals: tuple[Tensor, Tensor, Tensor]  # G of each ring, (R, B) each
    volumes: Tensor  # signed (P, B)
    part_x: Tensor  # Σ of each part's samples (P, B)
    part_z: Tensor
    com: tuple[Tensor, Tensor]  # x, z (B,)
    cop: tuple[Tensor, Tensor]
    total_pressure: Tensor  # (B,)


class Stages(NamedTuple):
    turned: Callable[[Tensor], Tensor]
    turned_back: Callable[[Tensor], Tensor]
    first: Callable[[Tensor], tuple[Tensor, Kept]]
    sample_gradient: Callable[[Tensor, Kept, Tensor], Tensor]
    gather_gradient: Callable[[Tensor, Kept, Tensor, Tensor], Tensor]


class BestTorch:
    """Stability, pull and push of a batch (B, V, 3), float32, over y = 0. Each batch size is compiled once."""

    def __init__(self, template: BodyTemplate, preset: str = "paper-r", compiled: bool = True) -> None:
        numbers = presets.get(preset)
        if numbers.stability != "norm" or numbers.epsilon != 0:
            raise ValueError(f"preset: expected one with the norm and no epsilon, got {preset!r}")
        self.numbers = numbers
        self.fixed = fixed_of(template)
        self.weights = _floats(list(numbers.weights.values()))
        self.compiled = compiled
        self.stages_of: dict[int, Stages] = {}

    def stages(self, batch: int) -> Stages:
        """The compiled functions for this batch size."""
        if batch not in self.stages_of:
            functions = [turned, turned_back, self._first, self._sample_gradient, self._gather_gradient]
            if self.compiled:
                # Eight bodies fill the lanes of AVX2; wider ones would stay empty.
                options: dict[str, Any] = {"cpp.simdlen": 256} if 1 < batch < 16 else {}
                functions = [torch.compile(f, fullgraph=True, dynamic=False, options=options) for f in functions]
            self.stages_of[batch] = Stages(*functions)
        return self.stages_of[batch]

    def terms(self, vertices: Tensor) -> Tensor:
        """(3, B), each with its own upstream gradient."""
        return _Terms.apply(vertices, self)

    def weighted(self, vertices: Tensor) -> Tensor:
        """The mean over the bodies of Σ λ · term, value and gradient in one pass."""
        return _Weighted.apply(vertices, self)

    def _first(self, points: Tensor) -> tuple[Tensor, Kept]:
        """Terms (3, B) of points (3 V, B)."""
        n, fixed = self.numbers, self.fixed
        x, y, z = points.unflatten(0, (-1, 3)).unbind(1)

        height = gather(y, fixed.samples)
        pressure, _ = pressure_of(height, n.alpha, n.gamma)
        load = apply(fixed.spread, pressure)
        total_pressure = total(pressure)
        cop = total(load * x) / total_pressure, total(load * z) / total_pressure

        closed = [torch.cat([axis, apply(fixed.lids, axis)]) for axis in (x, y, z)]
        normals, volume = rings_of(closed, fixed.rings)
        volumes = fixed.in_part @ volume
        part_x, part_z = fixed.part_sums @ x, fixed.part_sums @ z
        weight = volumes.abs()
        mass = (weight * fixed.part_counts).sum(0)
        com = (weight * part_x).sum(0) / mass, (weight * part_z).sum(0) / mass

        below = height < 0
        wave, _ = wave_of(height / torch.where(below, n.beta2, n.alpha2))
        pull = n.alpha1 / len(height) * total(torch.where(below, 0, wave))
        push = n.beta1 / len(height) * total(torch.where(below, wave, 0))
        stability = ((com[0] - cop[0]) ** 2 + (com[1] - cop[1]) ** 2).sqrt()
        kept = Kept(height, load, normals, volumes, part_x, part_z, com, cop, total_pressure)
        return torch.stack([stability, pull, push]), kept

    def _sample_gradient(self, points: Tensor, kept: Kept, upstream: Tensor) -> Tensor:
        """By the height of each sample, (S, B), of Σ upstream (3, B) · terms."""
        n, fixed = self.numbers, self.fixed
        x, _, z = points.unflatten(0, (-1, 3)).unbind(1)
        _, d_pull, d_push = upstream.unbind(0)
        d_com_x, d_com_z = d_center(kept, upstream)
        d_moment_x, d_moment_z = -d_com_x / kept.total_pressure, -d_com_z / kept.total_pressure
        d_total = -(d_moment_x * kept.cop[0] + d_moment_z * kept.cop[1])
        d_pressure = gather(d_moment_x * x + d_moment_z * z, fixed.samples) + d_total
        _, slope = pressure_of(kept.height, n.alpha, n.gamma)
        below = kept.height < 0
        _, wave_slope = wave_of(kept.height / torch.where(below, n.beta2, n.alpha2))
        d_wave = torch.where(below, n.beta1 / n.beta2 * d_push, n.alpha1 / n.alpha2 * d_pull) / len(kept.height)
        return d_pressure * slope + d_wave * wave_slope

    def _gather_gradient(self, points: Tensor, kept: Kept, upstream: Tensor, d_height: Tensor) -> Tensor:
        """By the vertices, (3 V, B)."""
        fixed = self.fixed
        d_com_x, d_com_z = d_center(kept, upstream)
        # CoP = Σ ρ v / Σ ρ, and its gradient is minus that of the CoM.
        d_moment_x, d_moment_z = -d_com_x / kept.total_pressure, -d_com_z / kept.total_pressure
        # CoM = Σ |vol| Σ v / Σ |vol| N over the parts.
        weight = kept.volumes.abs()
        mass = (weight * fixed.part_counts).sum(0)
        share = fixed.part_sums.T @ (weight / mass)
        d_x = d_com_x * share + d_moment_x * kept.load
        d_z = d_com_z * share + d_moment_z * kept.load
        lever_x = kept.part_x - kept.com[0] * fixed.part_counts
        lever_z = kept.part_z - kept.com[1] * fixed.part_counts
        d_volume = kept.volumes.sign() * (d_com_x * lever_x + d_com_z * lever_z) / mass
        d_ring = d_volume[fixed.part_of_ring]
        flat = (d_x, apply(fixed.spread, d_height), d_z)
        d = [own + apply(fixed.unite, d_ring * normal) for own, normal in zip(flat, kept.normals, strict=True)]
        return torch.stack(d, dim=1).flatten(0, 1)


def d_center(kept: Kept, upstream: Tensor) -> tuple[Tensor, Tensor]:
    """x, z (B,) of the gradient by the CoM: the direction from the CoP to it; 0 where they coincide."""
    across_x, across_z = kept.com[0] - kept.cop[0], kept.com[1] - kept.cop[1]
    distance = (across_x**2 + across_z**2).sqrt()
    scale = torch.where(distance > 0, upstream[0] / torch.where(distance > 0, distance, 1), 0)
    return scale * across_x, scale * across_z


def gradient(stages: Stages, points: Tensor, kept: Kept, upstream: Tensor) -> Tensor:
    """(B, V, 3) of Σ upstream (3, B) · terms."""
    d_height = stages.sample_gradient(points, kept, upstream)
    return stages.turned_back(stages.gather_gradient(points, kept, upstream, d_height))


class _Terms(torch.autograd.Function):
    @staticmethod
    def forward(ctx: Any, vertices: Tensor, peer: BestTorch) -> Tensor:
        ctx.stages = peer.stages(len(vertices))
        ctx.points = ctx.stages.turned(vertices.detach())
        terms, ctx.kept = ctx.stages.first(ctx.points)
        return terms

    @staticmethod
    def backward(ctx: Any, d_terms: Tensor) -> tuple[Tensor, None]:  # type: ignore[override]
        return gradient(ctx.stages, ctx.points, ctx.kept, d_terms.contiguous()), None


class _Weighted(torch.autograd.Function):
    @staticmethod
    def forward(ctx: Any, vertices: Tensor, peer: BestTorch) -> Tensor:
        stages = peer.stages(len(vertices))
        points = stages.turned(vertices.detach())
        terms, kept = stages.first(points)
        weights = peer.weights[:, None] / len(vertices)
        ctx.gradient = gradient(stages, points, kept, weights.expand_as(terms).contiguous())
        return (weights * terms).sum()

    @staticmethod
    def backward(ctx: Any, d_total: Tensor) -> tuple[Tensor, None]:  # type: ignore[override]
        found, ctx.gradient = ctx.gradient, None
        return found.mul_(d_total), None


# The turns, and the gradient by the samples, are compiled by themselves: fused with what gathers from them, inductor
# would compute them again at every read.


def turned(vertices: Tensor) -> Tensor:
    """(B, V, 3) -> (3 V, B): a plain transpose, which inductor does in tiles."""
    return vertices.flatten(1).T.contiguous()


def turned_back(points: Tensor) -> Tensor:
    """(3 V, B) -> (B, V, 3)."""
    return points.T.contiguous().unflatten(1, (-1, 3))


def pressure_of(height: Tensor, alpha: float, gamma: float) -> tuple[Tensor, Tensor]:
    """ρ and dρ/dh."""
    below = height < 0
    fading = torch.exp(-gamma * height)
    return torch.where(below, 1 - alpha * height, fading), torch.where(below, -alpha, -gamma * fading)


def wave_of(x: Tensor) -> tuple[Tensor, Tensor]:
    """tanh² and its derivative."""
    tanh = 1 - 2 / (torch.exp(2 * x) + 1)  # torch.tanh costs four times as much
    square = tanh * tanh
    return square, 2 * tanh * (1 - square)


def total(values: Tensor) -> Tensor:
    """The sum of each column, as a product: inductor's own reduction would walk down one column after the other, and
    compute its terms there."""
    return (values.new_ones(1, len(values)) @ values)[0]


def gather(values: Tensor, group: Group) -> Tensor:
    """Rows of a sparse matrix times values (N, B): (rows, B)."""
    result = values[group.indices[:, 0]] * group.weights[:, 0, None]
    for k in range(1, group.indices.shape[1]):
        result = result + values[group.indices[:, k]] * group.weights[:, k, None]
    return result


def apply(table: Table, values: Tensor) -> Tensor:
    """The whole sparse matrix times values (N, B)."""
    pieces = torch.cat([gather(values, group) for group in table.pieces])
    return torch.cat([gather(pieces, group) for group in table.rows])[table.place]


def rings_of(points: Sequence[Tensor], rings: Sequence[Tensor]) -> tuple[tuple[Tensor, Tensor, Tensor], Tensor]:
    """G of each ring, x, y, z (R, B), and v · G."""
    normals, volumes = [], []
    for ring in rings:
        centre = [axis[ring[:, 0]] for axis in points]
        width = ring.shape[1] - 1
        if width > RING_WIDTHS[-1]:
            around = [axis[ring[:, 1:]] - middle[:, None] for axis, middle in zip(points, centre, strict=True)]
            normal = [side.sum(1) / 6 for side in cross([r[:, :-1] for r in around], [r[:, 1:] for r in around])]
        else:
            around = [
                [axis[ring[:, 1 + k]] - middle for axis, middle in zip(points, centre, strict=True)]
                for k in range(width)
            ]
            sides = [cross(around[k], around[k + 1]) for k in range(width - 1)]
            normal = [sum(side[axis] for side in sides) / 6 for axis in range(3)]
        normals.append(normal)
        volumes.append(sum(middle * side for middle, side in zip(centre, normal, strict=True)))
    x, y, z = (torch.cat([normal[axis] for normal in normals]) for axis in range(3))
    return (x, y, z), torch.cat(volumes)


def cross(a: Sequence[Tensor], b: Sequence[Tensor]) -> list[Tensor]:
    return [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]


# The tables, built once for each template.


def fixed_of(template: BodyTemplate) -> Fixed:
    mesh = topology(template, torch.device("cpu"))
    triangles = mesh.triangles.numpy()
    parts = np.repeat(np.arange(template.num_parts), mesh.part_sizes)
    regressor = template.regressor()
    rings, ring_vertex, ring_part = _rings(triangles, parts)
    vertex_of_lid = [mesh.ring_vertices[mesh.ring_components == lid].tolist() for lid in range(len(mesh.ring_sizes))]

    # Which rings a vertex gathers: its own, and those of its lid by its share.
    takes: list[Row] = [[] for _ in range(template.num_vertices)]
    for ring, point in enumerate(ring_vertex):
        if point < template.num_vertices:
            takes[point].append((ring, 1.0))
        else:
            members = vertex_of_lid[point - template.num_vertices]
            for vertex in members:
                takes[vertex].append((ring, 1 / len(members)))

    indicator = np.zeros((template.num_parts, len(ring_part)))
    indicator[ring_part, np.arange(len(ring_part))] = 1 / 3
    part_of_sample = np.zeros((template.num_parts, template.num_samples))
    part_of_sample[template.sample_parts, np.arange(template.num_samples)] = 1
    counts = np.bincount(template.sample_parts, minlength=template.num_parts)
    transposed = regressor.T.tocsr()
    spread = [
        list(zip(transposed.indices[a:b].tolist(), transposed.data[a:b].tolist(), strict=True))
        for a, b in zip(transposed.indptr[:-1], transposed.indptr[1:], strict=True)
    ]
    lids = [[(vertex, 1 / len(members)) for vertex in members] for members in vertex_of_lid]
    return Fixed(
        samples=Group(mesh.samples, mesh.barycentric.float()),
        spread=_table(spread),
        lids=_table(lids),
        rings=rings,
        unite=_table(takes),
        part_of_ring=torch.tensor(ring_part),
        in_part=_floats(indicator),
        part_sums=_floats(part_of_sample @ regressor),
        part_counts=_floats(counts[:, None]),
    )


def _table(rows: Sequence[Row]) -> Table:
    """Rows of (column, weight)."""
    longest = ROW_WIDTHS[-1]
    pieces = [row[start : start + longest] for row in rows for start in range(0, max(len(row), 1), longest)]
    groups, place = _groups(pieces, ROW_WIDTHS)
    counts = [len(range(0, max(len(row), 1), longest)) for row in rows]
    ends = np.cumsum(counts)
    sums = [[(int(place[k]), 1.0) for k in range(end - count, end)] for end, count in zip(ends, counts, strict=True)]
    row_groups, row_place = _groups(sums, PIECE_WIDTHS)
    return Table(groups, row_groups, torch.tensor(row_place))


def _groups(rows: Sequence[Row], widths: Sequence[int]) -> tuple[tuple[Group, ...], NDArray]:
    """Groups of rows of one width, and where each row went."""
    grouped = _by_width([len(row) for row in rows], widths)
    place = np.empty(len(rows), np.int64)
    place[np.concatenate([members for _, members in grouped])] = np.arange(len(rows))
    return tuple(_group([rows[index] for index in members], width) for width, members in grouped), place


def _group(rows: Sequence[Row], width: int) -> Group:
    filled = [[*row, *[(0, 0.0)] * (width - len(row))] for row in rows]
    array = np.array(filled, dtype=float).reshape(len(rows), width, 2)
    return Group(torch.tensor(array[..., 0].astype(np.int64)), _floats(array[..., 1]))


def _rings(triangles: NDArray, parts: NDArray) -> tuple[tuple[Tensor, ...], list[int], NDArray]:
    """Groups of rings, and the vertex and the part of each ring in the order of the groups."""
    opposite: dict[tuple[int, int], dict[int, list[int]]] = {}
    for corners, part in zip(triangles.tolist(), parts.tolist(), strict=True):
        for k in range(3):
            edges = opposite.setdefault((corners[k], part), {})
            edges.setdefault(corners[k - 2], []).append(corners[k - 1])
    walks = {key: _walk(edges) for key, edges in opposite.items()}
    keys = list(walks)
    groups, order = [], []
    for width, members in _by_width([len(walks[key]) for key in keys], RING_WIDTHS):
        rows = [[keys[m][0], *walks[keys[m]]] for m in members]
        groups.append(torch.tensor([row + row[-1:] * (1 + width - len(row)) for row in rows]))
        order += [keys[m] for m in members]
    return tuple(groups), [vertex for vertex, _ in order], np.array([part for _, part in order])


def _walk(edges: dict[int, list[int]]) -> list[int]:
    """All directed edges in one walk that ends where it started.

    Between two loops it goes to the second one's start and, at the very end, back: such steps cancel in a sum of cross
    products.
    """
    starts, walk = [], []
    while edges:
        loop = _loop(next(iter(edges)), edges)
        starts.append(loop[0])
        walk += loop
    return walk + starts[-2::-1] if len(starts) > 1 else walk


def _loop(start: int, edges: dict[int, list[int]]) -> list[int]:
    """An Eulerian circuit from `start`, by Hierholzer's algorithm; it uses up its edges."""
    stack, loop = [start], []
    while stack:
        ways = edges.get(stack[-1])
        if ways:
            stack.append(ways.pop())
        else:
            edges.pop(stack[-1], None)
            loop.append(stack.pop())
    return loop[::-1]


def _by_width(lengths: Sequence[int], widths: Sequence[int]) -> list[tuple[int, NDArray]]:
    """Widths, and which rows are filled up to each; rows longer than all share the width of the longest."""
    every = np.array([*widths, max(max(lengths), widths[-1] + 1)])
    taken = every[np.searchsorted(every, np.maximum(lengths, 1))]
    return [(int(width), np.flatnonzero(taken == width)) for width in every if (taken == width).any()]


def _floats(array: ArrayLike) -> Tensor:
    return torch.tensor(np.asarray(array), dtype=torch.float32)
