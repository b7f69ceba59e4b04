"""numpy, scipy and trimesh as their users would call them: base of support, volume, mass, centre, inertia."""

from __future__ import annotations

import numpy as np
import trimesh
from numpy.typing import NDArray
from scipy.spatial import ConvexHull

from ipman_rs import BodyTemplate, Ground, base_of_support, mass_properties


class Metrics:
    """Metrics of bodies (B, V, 3) over y = 0, each from the vertices on."""

    def __init__(self, template: BodyTemplate) -> None:
        self.template = template
        self.regressor = template.regressor()
        self.ground = Ground.y_up()

    def our_margin(self, vertices: NDArray) -> NDArray:
        return base_of_support(vertices, self.template, self.ground).margin

    def scipy_margin(self, vertices: NDArray, threshold: float = 0.1) -> NDArray:
        """W V in one sparse product, the centre of mass vectorised, one ConvexHull a body, and the nearest of its lines
        (exact inside, where bodies that stand are)."""
        flat = np.ascontiguousarray(vertices.transpose(1, 0, 2)).reshape(vertices.shape[1], -1)
        samples = (self.regressor.astype(flat.dtype) @ flat).reshape(-1, len(vertices), 3)
        volumes = np.abs(self._closed_volumes(vertices))
        weight = volumes[:, self.template.sample_parts].T
        com = np.einsum("sb,sbk->bk", weight, samples) / weight.sum(axis=0)[:, None]
        margins = []
        for body in range(len(vertices)):
            own = samples[:, body]
            contacts = own[np.abs(own[:, 1]) < threshold][:, [0, 2]]
            if len(contacts) < 3:
                margins.append(-np.inf)
                continue
            lines = ConvexHull(contacts).equations
            margins.append(-(lines[:, :2] @ com[body, [0, 2]] + lines[:, 2]).max())
        return np.array(margins)

    def our_mass(self, vertices: NDArray) -> tuple[NDArray, NDArray, NDArray]:
        """Volume (B,), centre (B, 3), inertia (B, 3, 3)."""
        found = mass_properties(vertices, self.template)
        return found.volume, found.center, found.inertia

    def trimesh_mass(self, vertices: NDArray, density: float = 985.0) -> tuple[NDArray, NDArray, NDArray]:
        volume, center, inertia = [], [], []
        for body in vertices:
            mesh = trimesh.Trimesh(body, self.template.faces, process=False, validate=False)
            mesh.density = density
            volume.append(mesh.volume)
            center.append(mesh.center_mass)
            inertia.append(mesh.moment_inertia)
        return np.array(volume), np.array(center), np.array(inertia)

    def _closed_volumes(self, vertices: NDArray) -> NDArray:
        """Signed volumes of the closed parts (B, P)."""
        if not hasattr(self, "_closed"):
            import torch

            from ipman_rs.torch.reference.topology import topology

            mesh = topology(self.template, torch.device("cpu"))
            rings = [mesh.ring_vertices[mesh.ring_components == k].numpy() for k in range(len(mesh.ring_sizes))]
            self._closed = mesh.triangles.numpy(), rings, np.cumsum([0, *mesh.part_sizes[:-1]])
        triangles, rings, starts = self._closed
        lids = [vertices[:, ring].mean(axis=1, keepdims=True) for ring in rings]
        points = np.concatenate([vertices, *lids], axis=1)
        points = points - points.mean(axis=1, keepdims=True)
        a, b, c = (points[:, triangles[:, k]] for k in range(3))
        return np.add.reduceat(np.einsum("btk,btk->bt", np.cross(a, b), c) / 6, starts, axis=1)
