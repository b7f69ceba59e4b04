"""Distances along a body's surface, as shortest paths over the edges of its template: which vertices are far apart."""

from __future__ import annotations

from functools import lru_cache

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csr_array
from scipy.sparse.csgraph import dijkstra

from ipman_rs import BodyTemplate

Indices = NDArray[np.integer]


class Geodesics:
    """Which vertices of a template are more than `limit` metres apart; computed once per vertex, on first use."""

    def __init__(self, template: BodyTemplate, limit: float):
        edges = np.concatenate([template.faces[:, [i, (i + 1) % 3]] for i in range(3)])
        edges = np.unique(np.sort(edges, axis=1), axis=0)
        lengths = np.linalg.norm(template.vertices[edges[:, 0]] - template.vertices[edges[:, 1]], axis=1)
        self.graph = csr_array((lengths, edges.T), shape=(template.num_vertices,) * 2)
        self.limit = limit
        self._rows = np.full(template.num_vertices, -1)  # of each vertex in `_far`
        self._far = np.zeros((0, template.num_vertices), bool)

    def rows(self, vertices: Indices) -> NDArray[np.bool_]:
        """(n, V) which vertices are far from these (n,)."""
        new = np.unique(vertices[self._rows[vertices] < 0])
        if len(new):
            far = np.isinf(dijkstra(self.graph, directed=False, indices=new, limit=self.limit))
            self._rows[new] = len(self._far) + np.arange(len(new))
            self._far = np.concatenate([self._far, far])
        return self._far[self._rows[vertices]]

    def far(self, first: Indices, second: Indices) -> NDArray[np.bool_]:
        """(n,) whether each of the first vertices (n,) is far from its second (n,)."""
        self.rows(np.unique(first))
        return self._far[self._rows[first], second]


@lru_cache(maxsize=16)
def geodesics(template: BodyTemplate, limit: float) -> Geodesics:
    """The same object for the same template and limit: what it found is kept."""
    return Geodesics(template, limit)
