"""Presented contact (SMPLify-XMC): surfaces that touch in the presented pose touch again,

    mean over i of tanh(min_j |v_i − v_j|)     metres

over the presented contact vertices i, j that are more than 0.3 m apart along the surface. Distances along the surface
are shortest paths over the template's edges.
"""

from __future__ import annotations

import numpy as np
import torch
from numpy.typing import NDArray
from scipy.sparse import csr_array
from scipy.sparse.csgraph import dijkstra
from torch import Tensor

from ipman_rs import BodyTemplate
from ipman_rs.checks import positive

from ..candidate import Candidate
from ..problem import Problem
from .term import Term


class PresentedContact(Term):
    """geodesic: metres along the surface from where on two vertices count as different places."""

    needs_mesh = True

    def __init__(self, problem: Problem, geodesic: float = 0.3):
        super().__init__(problem)
        if problem.presented is None or problem.presented.contact is None:
            raise ValueError("presented_contact: expected the vertices that touch in the presented pose, got none")
        contact = np.unique(problem.presented.contact.numpy(force=True))
        count = problem.body.template.num_vertices
        if contact.dtype.kind not in "iu" or contact.size == 0 or contact[0] < 0 or contact[-1] >= count:
            raise ValueError(f"presented_contact: expected indices of vertices, 0 to {count - 1}, one at least")
        far = far_apart(problem.body.template, contact, positive("geodesic", geodesic))
        partnered = far.any(axis=1)
        if not partnered.any():
            raise ValueError(
                f"presented_contact: no two of the {len(contact)} contact vertices are more than {geodesic} m apart "
                "along the surface; give both surfaces that touch"
            )
        # far is symmetric: a vertex without a partner is nobody's partner
        self.contact = torch.from_numpy(contact[partnered])
        self.near = torch.from_numpy(~far[np.ix_(partnered, partnered)])

    def cost(self, candidate: Candidate) -> Tensor:
        points = candidate.vertices[:, self.contact]
        partners = torch.stack([self._partners(body) for body in points.detach()])
        offset = points - points.gather(1, partners[..., None].expand(-1, -1, 3))
        x, y, z = offset.unbind(-1)
        squared = x * x + y * y + z * z
        apart = squared > 0
        distance = torch.where(apart, torch.where(apart, squared, 1).sqrt(), 0)  # no gradient where they coincide
        return distance.tanh().mean(dim=-1)

    def _partners(self, points: Tensor) -> Tensor:
        """(n,) which of the points (n, 3) of one body is the nearest far one of each."""
        squared = sum((axis[:, None] - axis).square() for axis in points.T)
        return torch.as_tensor(squared).masked_fill(self.near, torch.inf).argmin(dim=1)


def far_apart(template: BodyTemplate, vertices: NDArray[np.integer], geodesic: float) -> NDArray[np.bool_]:
    """(n, n) which of the vertices (n,) are more than `geodesic` metres apart along the template's edges."""
    edges = np.concatenate([template.faces[:, [i, (i + 1) % 3]] for i in range(3)])
    edges = np.unique(np.sort(edges, axis=1), axis=0)
    lengths = np.linalg.norm(template.vertices[edges[:, 0]] - template.vertices[edges[:, 1]], axis=1)
    graph = csr_array((lengths, edges.T), shape=(template.num_vertices,) * 2)
    return np.isinf(dijkstra(graph, directed=False, indices=vertices, limit=geodesic))[:, vertices]
