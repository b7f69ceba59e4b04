"""The separate pieces of a surface: several large ones are hardly one person, and small ones below it are no feet."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from ipman_rs.ground import Ground

from .check import Finding

LARGE = 0.25  # of the largest piece's size: no eye, tooth or shoe is as large
GAP = 0.01  # of the largest piece's size: a shoe is no farther below the foot in it

Array = NDArray[np.floating[Any]]


def check_pieces(vertices: Array, faces: NDArray[np.integer[Any]], normal: Array) -> list[Finding]:
    """Whether a surface, vertices (V, 3) and faces (F, 3), is one person's; `normal` (3,) points up."""
    used, piece = connected_pieces(faces)
    if not len(used) or piece.max() == 0:
        return []
    points = np.asarray(vertices, np.float64)[used]
    size = (_extreme_per_piece(np.maximum, points, piece) - _extreme_per_piece(np.minimum, points, piece)).max(axis=1)
    large = size >= LARGE * size.max()
    findings = []
    if large.sum() > 1:
        what = f"{large.sum()} large separate pieces are measured as one body"
        findings.append(Finding("odd", what, "several people, things beside one, or clothes over one?"))
    return findings + _below(points @ Ground(normal).normal, piece, large, GAP * float(size.max()))


def _below(heights: Array, piece: NDArray[np.int64], large: NDArray[np.bool_], gap: float) -> list[Finding]:
    """Of small pieces that lie wholly below the large ones: the ground and the contact would be theirs."""
    lowest = heights[large[piece]].min()
    below = (~large & (_extreme_per_piece(np.maximum, heights, piece) < lowest - gap))[piece]
    if not below.any():
        return []
    what = f"{below.sum():,} of {len(heights):,} vertices, in small separate pieces, lie up to "
    what += f"{lowest - heights.min():.2f} m below the body"
    return [Finding("odd", what, "the ground and the contact are theirs: take them out of the file")]


def connected_pieces(faces: NDArray[np.integer[Any]]) -> tuple[NDArray[np.integer[Any]], NDArray[np.int64]]:
    """The vertices (N,) that faces (F, 3) use, and for each the number of its piece, from 0: faces join vertices."""
    from scipy.sparse import coo_array
    from scipy.sparse.csgraph import connected_components

    used, corners = np.unique(faces, return_inverse=True)
    edges = corners.reshape(-1, 3)[:, [0, 1, 1, 2]].reshape(-1, 2).T
    links = coo_array((np.ones(edges.shape[1], np.int8), tuple(edges)), shape=(len(used),) * 2)
    return used, connected_components(links, directed=False)[1].astype(np.int64)


def _extreme_per_piece(extreme: np.ufunc, values: Array, piece: NDArray[np.int64]) -> Array:
    """The extreme of the values (N, …) of each piece."""
    order = np.argsort(piece, kind="stable")
    starts = np.searchsorted(piece[order], np.arange(piece.max() + 1))
    return extreme.reduceat(values[order], starts)
