"""(a) The paper's procedure as research code organises it, written afresh.

A batch at once, but part after part in Python: at every call each part's faces and lids are looked up again, its closed
mesh is put together, moved to its centroid and filled with tetrahedra one face each; every sample gets its
part's volume by a loop; samples are a sparse product in double precision with all coordinates side by side. Autograd
gives the gradient. The base of support is the linear programme "is the centre a convex combination of the contacts?".
"""

from __future__ import annotations

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor

from ipman_rs import BodyTemplate, presets
from ipman_rs.torch.reference.topology import topology


class Literal:
    """The three terms of paper-r, over y = 0."""

    def __init__(self, template: BodyTemplate, preset: str = "paper-r") -> None:
        self.numbers = presets.get(preset)
        self.template = template
        self.regressor = _per_coordinate(template)
        self.faces = template.faces
        self.face_parts = template.face_parts
        self.sample_parts = torch.tensor(template.sample_parts)
        mesh = topology(template, torch.device("cpu"))
        self.lid_of_vertex = np.full(template.num_vertices, -1)
        self.lid_of_vertex[mesh.ring_vertices.numpy()] = mesh.ring_components.numpy()
        # Boundaries come with the segmentation files; what is built upon them is built at each call.
        self.boundaries = [_boundary(self.faces[self.face_parts == part]) for part in range(template.num_parts)]

    def terms(self, vertices: Tensor) -> Tensor:
        """(3, B)."""
        n = self.numbers
        samples = self.samples(vertices)
        com = self.center_of_mass(vertices, samples)
        height = samples[..., 1]
        below = height < 0
        pressure = torch.where(below, 1 - n.alpha * height, torch.exp(-n.gamma * height))
        cop = (pressure[..., None] * samples).sum(dim=1) / pressure.sum(dim=1, keepdim=True)
        on_floor = torch.tensor([1.0, 0.0, 1.0], dtype=samples.dtype)
        stability = torch.norm((com - cop) * on_floor, dim=-1)
        pull = torch.where(below, 0.0, n.alpha1 * torch.tanh(height / n.alpha2) ** 2).mean(dim=1)
        push = torch.where(below, n.beta1 * torch.tanh(height / n.beta2) ** 2, 0.0).mean(dim=1)
        return torch.stack([stability, pull, push])

    def weighted(self, vertices: Tensor) -> Tensor:
        """The mean over the bodies."""
        stability, pull, push = (
            weight * term.mean()
            for weight, term in zip(self.numbers.weights.values(), self.terms(vertices), strict=True)
        )
        return stability + pull + push

    def samples(self, vertices: Tensor) -> Tensor:
        """v = W V by a sparse product in double: (B, S, 3)."""
        flat = vertices.reshape(len(vertices), -1).T.double()
        return torch.sparse.mm(self.regressor, flat).T.reshape(len(vertices), -1, 3)

    def center_of_mass(self, vertices: Tensor, samples: Tensor) -> Tensor:
        """The samples weighted by the volume of their part: (B, 3)."""
        volumes = self.part_volumes(vertices)
        weight = torch.zeros(samples.shape[:2], dtype=samples.dtype)
        for part, volume in enumerate(volumes):
            chosen = torch.nonzero(self.sample_parts == part)[:, 0]
            weight[:, chosen] = volume.to(samples.dtype)[:, None]
        return (weight[..., None] * samples).sum(dim=1) / weight.sum(dim=1, keepdim=True)

    def part_volumes(self, vertices: Tensor) -> list[Tensor]:
        """Close, translate, fill: P volumes (B,)."""
        return [self._volume(vertices, part) for part in range(self.template.num_parts)]

    def _volume(self, vertices: Tensor, part: int) -> Tensor:
        faces = self.faces[self.face_parts == part]
        members = np.unique(faces)
        local = np.full(self.template.num_vertices, -1)
        local[members] = np.arange(len(members))
        points, triangles = vertices[:, torch.tensor(members)], [local[faces]]

        edges = self.boundaries[part]
        for lid in np.unique(self.lid_of_vertex[edges[:, 0]]) if len(edges) else ():
            of_lid = torch.tensor(np.flatnonzero(self.lid_of_vertex == lid))
            centre = vertices[:, of_lid].mean(dim=1, keepdim=True)
            fan = local[edges[self.lid_of_vertex[edges[:, 0]] == lid]]
            triangles.append(np.column_stack([fan[:, 1], fan[:, 0], np.full(len(fan), points.shape[1])]))
            points = torch.cat([points, centre], dim=1)

        points = points - points.mean(dim=1, keepdim=True)
        corners = points[:, torch.tensor(np.concatenate(triangles))]
        a, b, c = corners.unbind(dim=2)
        return ((torch.cross(a, b, dim=-1) * c).sum(dim=-1) / 6).sum(dim=-1).abs()

    def is_supported(self, vertices: Tensor, threshold: float = 0.1) -> NDArray[np.bool_]:
        """BoSE of each body by linear programming: (B,)."""
        from scipy.optimize import linprog

        samples = self.samples(vertices)
        com = self.center_of_mass(vertices, samples).numpy()[:, [0, 2]]
        samples = samples.numpy()
        inside = []
        for body, centre in zip(samples, com, strict=True):
            contacts = body[np.abs(body[:, 1]) < threshold][:, [0, 2]]
            rows = np.vstack([contacts.T, np.ones(len(contacts))])
            found = linprog(np.zeros(len(contacts)), A_eq=rows, b_eq=[*centre, 1.0]) if len(contacts) else None
            inside.append(found is not None and found.success)
        return np.array(inside)


def _per_coordinate(template: BodyTemplate) -> Tensor:
    """W for flattened vertices: (3 S, 3 V), double, coordinate format."""
    regressor = template.regressor().tocoo()
    rows = np.concatenate([3 * regressor.row + axis for axis in range(3)])
    columns = np.concatenate([3 * regressor.col + axis for axis in range(3)])
    shape = (3 * template.num_samples, 3 * template.num_vertices)
    entries = torch.tensor(np.tile(regressor.data, 3))
    return torch.sparse_coo_tensor(torch.tensor(np.stack([rows, columns])), entries, shape).coalesce()


def _boundary(faces: NDArray) -> NDArray:
    """Directed edges whose reverse belongs to no face of the part."""
    edges = np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]])
    known = set(map(tuple, edges.tolist()))
    return np.array([edge for edge in edges.tolist() if (edge[1], edge[0]) not in known]).reshape(-1, 2)
