"""Repairs that make a surface of a mesh file: shared vertices, no loose vertices, no repeated faces.

Every repair leaves a note, and `vertex_map` says where each vertex of the file went.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from . import text

Array = NDArray[np.float64]
Indices = NDArray[np.int64]

WELD = 1e-5  # of the mesh's size: 0.02 mm of a person. Rounding to float32 moves a corner by a hundredth of it.
SOUP = 2 / 3  # the share of edges with a face on one side only, above which there is no surface


@dataclass(frozen=True)
class Mesh:
    """``vertices`` (V, 3) in the file's unit and ``faces`` (F, 3).

    ``vertex_map`` (N,): the vertex that each vertex of the file became, −1 for those left out; None: each its own.
    ``face_map`` (F,): the triangle of the file that each face was; None: each its own.
    """

    vertices: Array
    faces: Indices
    vertex_map: Indices | None = None
    face_map: Indices | None = None
    notes: tuple[str, ...] = ()

    def noting(self, note: str) -> Mesh:
        return replace(self, notes=(*self.notes, note))


def repair_mesh(mesh: Mesh) -> Mesh:
    """The surface of a mesh. ValueError where its faces name vertices that it has not, or share none."""
    outside = (mesh.faces < 0) | (mesh.faces >= len(mesh.vertices))
    if outside.any():
        raise ValueError(f"a face names vertex {mesh.faces[outside][0]} of {len(mesh.vertices)} (counted from 0)")
    return drop_unused_vertices(weld(drop_repeated_faces(mesh)))


def drop_repeated_faces(mesh: Mesh) -> Mesh:
    """Without faces that use a vertex twice, and without the second of two equal faces."""
    faces = mesh.faces
    flat = (faces == np.roll(faces, 1, axis=1)).any(axis=1)
    unique = np.flatnonzero(~flat)
    first = _first_of_equal_faces(faces[unique])
    again = len(unique) - len(first)
    if not flat.any() and not again:
        return mesh
    unique = unique[first]
    face_map = unique if mesh.face_map is None else mesh.face_map[unique]
    mesh = replace(mesh, faces=faces[unique], face_map=face_map)
    if flat.any():
        mesh = mesh.noting(f"{text.count_of(int(flat.sum()), 'face')} without area (a vertex twice) left out")
    if again:
        mesh = mesh.noting(f"{text.count_of(again, 'repeated face')} left out")
    return mesh


def _first_of_equal_faces(faces: Indices) -> Indices:
    """The place of the first of each distinct face, ascending; a face may begin at any of its corners."""
    lowest = np.argmin(faces, axis=1)[:, None]
    turned = np.take_along_axis(faces, (lowest + [0, 1, 2]) % 3, axis=1)
    edge = np.sort(turned[:, 0] * (faces.max(initial=0) + 1) + turned[:, 1])
    if (edge[1:] != edge[:-1]).all():  # equal faces share their directed edges, which a surface has once
        return np.arange(len(faces))
    return np.sort(_distinct(turned)[0])


def _distinct(rows: NDArray[np.generic]) -> tuple[Indices, Indices]:
    """The place of the first of each distinct row, and which of these each row is: np.unique, ten times as fast."""
    order = np.lexsort(rows.T[::-1])
    new = np.ones(len(rows), bool)
    new[1:] = (rows[order[1:]] != rows[order[:-1]]).any(axis=1)
    number = np.empty(len(rows), np.int64)
    number[order] = np.cumsum(new) - 1
    return order[new], number


def weld(mesh: Mesh) -> Mesh:
    """Vertices at equal places merged where faces do not share them (STL, texture seams); closed meshes stay.

    Where that leaves open edges, vertices of those edges that lie within WELD of the mesh's size are merged, too.
    ValueError where faces share no edges even then, or where none is left.
    """
    if len(mesh.faces) and not len(_open_edges(mesh.faces)):
        return mesh
    first, number = _distinct(mesh.vertices + 0.0)
    if len(first) < len(mesh.vertices):
        merged = len(mesh.vertices) - len(first)
        mesh = drop_repeated_faces(_merge(mesh, first[number]))
        mesh = mesh.noting(f"{text.count_of(merged, 'vertex', 'vertices')} that lie on each other were merged")
    border = np.unique(_open_edges(mesh.faces))
    tolerance = WELD * _size(mesh.vertices[np.unique(mesh.faces)])
    if len(border) and 0.0 < tolerance < np.inf:
        target = np.arange(len(mesh.vertices))
        target[border] = border[_nearby(mesh.vertices[border], tolerance)]
        merged = int((target != np.arange(len(target))).sum())
        if merged:
            mesh = drop_repeated_faces(_merge(mesh, target)).noting(
                f"{text.count_of(merged, 'vertex', 'vertices')} within {tolerance:.1g} of another were merged"
            )
    if not len(mesh.faces):
        raise ValueError("none of its faces has an area")
    share = len(_open_edges(mesh.faces)) / (3 * len(mesh.faces))
    if share > SOUP:
        what = f"its faces share no vertices ({share:.0%} of their edges have no neighbour), so there is no surface"
        raise ValueError(f"{what}; merge its vertices by distance first (MeshLab, Blender)")
    return mesh


def _size(points: Array) -> float:
    """The longest side of the box around the points, m; NaN where one is not finite."""
    with np.errstate(over="ignore", invalid="ignore"):
        return float((points.max(axis=0) - points.min(axis=0)).max()) if len(points) else 0.0


def _open_edges(faces: Indices) -> Indices:
    """(E, 2) the edges that have a face on one side only, lower vertex first."""
    if not len(faces):
        return np.empty((0, 2), np.int64)
    width = faces.max() + 1
    low, high = np.minimum(faces, np.roll(faces, -1, axis=1)), np.maximum(faces, np.roll(faces, -1, axis=1))
    key = np.sort((low * width + high).reshape(-1))
    differs = np.concatenate([[True], key[1:] != key[:-1], [True]])
    single = key[differs[1:] & differs[:-1]]
    return np.stack(np.divmod(single, width), axis=1)


def _merge(mesh: Mesh, target: Indices) -> Mesh:
    """Each vertex becomes its target, a vertex with a lower number or itself; the order stays the file's."""
    remaining = np.flatnonzero(target == np.arange(len(target)))
    return _renumber(mesh, remaining, np.searchsorted(remaining, target))


def _renumber(mesh: Mesh, remaining: Indices, number: Indices) -> Mesh:
    """The vertices ``kept``; ``number`` (V,) is the new one of each, −1 for those left out."""
    old = mesh.vertex_map
    vertex_map = number if old is None else np.where(old < 0, -1, number[old])
    return replace(mesh, vertices=mesh.vertices[remaining], faces=number[mesh.faces], vertex_map=vertex_map)


def _nearby(points: Array, distance: float) -> Indices:
    """(N,) the first of the points that are joined to each by steps of at most ``distance``.

    Points in one cell of a grid of that width, and in cells that touch, are joined: the time is N log N however
    densely they lie.
    """
    from scipy.sparse import coo_array
    from scipy.sparse.csgraph import connected_components

    grid = np.floor((points - points.min(axis=0)) / distance).astype(np.int64) + 1
    width = grid.max(axis=0) + 2
    step = np.array([width[1] * width[2], width[2], 1])
    cells, first, inverse = np.unique(grid @ step, return_index=True, return_inverse=True)
    ahead = [o for o in np.ndindex(3, 3, 3) if o > (1, 1, 1)]
    pairs = []
    for offset in (np.array(ahead) - 1) @ step:
        place = np.minimum(np.searchsorted(cells, cells + offset), len(cells) - 1)
        touching = np.flatnonzero(cells[place] == cells + offset)
        pairs.append(np.stack([touching, place[touching]]))
    rows, columns = np.concatenate(pairs, axis=1)
    links = coo_array((np.ones(len(rows), np.int8), (rows, columns)), shape=(len(cells), len(cells)))
    count, group = connected_components(links, directed=False)
    lowest = np.full(count, len(points))
    np.minimum.at(lowest, group, first)
    return lowest[group[inverse.reshape(-1)]]


def drop_unused_vertices(mesh: Mesh) -> Mesh:
    """Without the vertices that no face uses: they would count as the body's lowest point or its size."""
    used = np.zeros(len(mesh.vertices), bool)
    used[mesh.faces] = True
    if used.all():
        return mesh
    loose = text.count_of(int((~used).sum()), "vertex", "vertices")
    number = np.where(used, np.cumsum(used) - 1, -1)
    return _renumber(mesh, np.flatnonzero(used), number).noting(f"{loose} that no face uses left out")
