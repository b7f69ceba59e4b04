"""Where the parts of a template meet, and the caps that close them.

Derived here from `faces` and `face_parts` alone, with scipy, so that it judges the compiled core instead of repeating
it. Index tensors are built once for each (template, device).
"""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from typing import TYPE_CHECKING
from weakref import WeakKeyDictionary

import numpy as np
import torch
from torch import Tensor

from ..compiling import assume_constant_result

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from ipman_rs import BodyTemplate


@dataclass(frozen=True)
class Topology:
    """Index tensors of one template on one device.

    ring_vertices (R,)      vertices on a boundary, each once
    ring_components (R,)    which boundary component each of them belongs to, in [0, C)
    ring_sizes (C,)         vertices of each component
    triangles (T, 3)        faces and caps sorted by part; an index >= V names the virtual vertex `index - V`
    part_sizes              triangles of each part, in part order
    faces (F, 3)            the template's own faces
    samples (S, 3)          the three vertices of each sample
    barycentric (S, 3)      their weights, float64
    sample_parts (S,)       the part of each sample
    """

    ring_vertices: Tensor
    ring_components: Tensor
    ring_sizes: Tensor
    triangles: Tensor
    part_sizes: tuple[int, ...]
    faces: Tensor
    samples: Tensor
    barycentric: Tensor
    sample_parts: Tensor
    rest_vertices: Tensor


_cache: WeakKeyDictionary[BodyTemplate, dict[torch.device, Topology]] = WeakKeyDictionary()


@assume_constant_result
def topology(template: BodyTemplate, device: torch.device) -> Topology:
    """The index tensors of `template` on `device`, built at the first call."""
    on_devices = _cache.setdefault(template, {})
    if device not in on_devices:
        # In a thread of its own, where no torch.func transform of the caller wraps the tensors that outlive it.
        with ThreadPoolExecutor(max_workers=1) as outside:
            on_devices[device] = outside.submit(_build, template, device).result()
    return on_devices[device]


def boundary_half_edges(faces: NDArray[np.int64], face_parts: NDArray[np.int64]) -> tuple[NDArray, NDArray]:
    """Directed edges (E, 2) that no face of the same part runs through backwards, and the part (E,) of each."""
    half_edges = np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]])
    parts = np.tile(face_parts, 3)
    count = int(faces.max()) + 1
    forward = (parts * count + half_edges[:, 0]) * count + half_edges[:, 1]
    backward = (parts * count + half_edges[:, 1]) * count + half_edges[:, 0]
    alone = ~np.isin(forward, backward)
    return half_edges[alone], parts[alone]


def _build(template: BodyTemplate, device: torch.device) -> Topology:
    faces, face_parts = np.asarray(template.faces), np.asarray(template.face_parts)
    edges, edge_parts = boundary_half_edges(faces, face_parts)
    ring, component, sizes = _components(edges, template.num_vertices)

    component_of = np.full(template.num_vertices, -1)
    component_of[ring] = component
    centre = template.num_vertices + component_of[edges[:, 0]]
    caps = np.stack([edges[:, 1], edges[:, 0], centre], axis=1)

    triangles, parts = np.concatenate([faces, caps]), np.concatenate([face_parts, edge_parts])
    order = np.argsort(parts, kind="stable")

    def tensor(array: NDArray) -> Tensor:
        return torch.tensor(np.ascontiguousarray(array), device=device)

    return Topology(
        ring_vertices=tensor(ring),
        ring_components=tensor(component),
        ring_sizes=tensor(sizes),
        triangles=tensor(triangles[order]),
        part_sizes=tuple(np.bincount(parts, minlength=template.num_parts).tolist()),
        faces=tensor(faces),
        samples=tensor(faces[np.asarray(template.sample_faces)]),
        barycentric=_floating(template.sample_barycentric, device),
        sample_parts=tensor(np.asarray(template.sample_parts, dtype=np.int64)),
        rest_vertices=_floating(template.vertices, device),
    )


def widest(device: torch.device) -> torch.dtype:
    """float64, except on devices that have none."""
    return torch.float32 if device.type == "mps" else torch.float64


def _floating(array: NDArray, device: torch.device) -> Tensor:
    return torch.tensor(np.asarray(array), device=device, dtype=widest(device))


def _components(edges: NDArray, num_vertices: int) -> tuple[NDArray, NDArray, NDArray]:
    """Boundary vertices, the connected component of each, and the component sizes."""
    from scipy.sparse import coo_array
    from scipy.sparse.csgraph import connected_components

    graph = coo_array((np.ones(len(edges)), (edges[:, 0], edges[:, 1])), shape=(num_vertices, num_vertices))
    _, label = connected_components(graph, directed=False)
    ring = np.unique(edges)
    _, component, sizes = np.unique(label[ring], return_inverse=True, return_counts=True)
    return ring, component.reshape(-1), sizes
