"""What the tuned path needs of a template, laid out once for each (template, device, dtype)."""

from __future__ import annotations

from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, TypeVar
from weakref import WeakKeyDictionary

import numpy as np
import torch
from torch import Tensor

from ..compiling import assume_constant_result
from ..reference.topology import topology
from .sparse import SparseRows, sparse_rows

if TYPE_CHECKING:
    from scipy.sparse import csr_array

    from ipman_rs import BodyTemplate

Built = TypeVar("Built")


@dataclass(frozen=True, eq=False)
class Matrices:
    """The template's linear maps, scipy CSR on the host; V vertices, C virtual ones, T triangles with caps, S samples.

    centres (C, V)        vertices -> virtual vertices: the mean of each boundary component
    incidence (V + C, T)  triangles -> their corners
    parts (P, T)          triangles -> their part
    samples (S, V)        vertices -> samples: the paper's W
    sample_sums (P, V)    vertices -> sum of each part's samples
    triangles (T, 3)      corners, sorted by part; an index >= V names a virtual vertex
    triangle_parts (T,)
    origin                a vertex in the middle of the body: coordinates are taken from it
    """

    centres: csr_array
    incidence: csr_array
    parts: csr_array
    samples: csr_array
    sample_sums: csr_array
    triangles: np.ndarray
    triangle_parts: np.ndarray
    origin: int


@dataclass(frozen=True, eq=False)
class Tables:
    """`Matrices` and the transposes that gradients need, as gather tables on a device."""

    origin: int
    rest: Tensor
    corners: Tensor
    triangle_parts: Tensor
    part_sizes: Tensor
    centres: SparseRows
    centres_back: SparseRows
    incidence: SparseRows
    parts: SparseRows
    samples: SparseRows
    samples_back: SparseRows
    sample_sums: SparseRows
    sample_sums_back: SparseRows


class PerTemplate:
    """Keeps what `build(template, device, dtype)` made for as long as the template lives."""

    def __init__(self, build: Callable[[BodyTemplate, torch.device, torch.dtype], Any]) -> None:
        self._build = build
        self._made: WeakKeyDictionary[BodyTemplate, dict[tuple[torch.device, torch.dtype], Any]] = WeakKeyDictionary()

    def __call__(self, template: BodyTemplate, device: torch.device, dtype: torch.dtype) -> Any:
        made = self._made.setdefault(template, {})
        if (device, dtype) not in made:
            # In a thread of its own, where no torch.func transform or fake mode of the caller wraps what outlives it.
            with ThreadPoolExecutor(max_workers=1) as outside:
                made[device, dtype] = outside.submit(self._build, template, device, dtype).result()
        return made[device, dtype]


def matrices(template: BodyTemplate) -> Matrices:
    """The linear maps, from the topology that the reference formulas use."""
    from scipy.sparse import csr_array

    mesh = topology(template, torch.device("cpu"))
    triangles = mesh.triangles.numpy()
    triangle_parts = np.repeat(np.arange(template.num_parts), mesh.part_sizes)
    num_vertices, num_centres, count = template.num_vertices, len(mesh.ring_sizes), len(triangles)

    ring, component = mesh.ring_vertices.numpy(), mesh.ring_components.numpy()
    share = 1 / mesh.ring_sizes.numpy()[component]
    samples = csr_array(template.regressor())
    part_of_sample = csr_array(
        (np.ones(template.num_samples), (mesh.sample_parts.numpy(), np.arange(template.num_samples))),
        shape=(template.num_parts, template.num_samples),
    )
    middle = np.linalg.norm(template.vertices - template.vertices.mean(axis=0), axis=1).argmin()
    return Matrices(
        centres=csr_array((share, (component, ring)), shape=(num_centres, num_vertices)),
        incidence=csr_array(
            (np.ones(3 * count), (triangles.ravel(), np.repeat(np.arange(count), 3))),
            shape=(num_vertices + num_centres, count),
        ),
        parts=csr_array((np.ones(count), (triangle_parts, np.arange(count))), shape=(template.num_parts, count)),
        samples=samples,
        sample_sums=csr_array(part_of_sample @ samples),
        triangles=triangles,
        triangle_parts=triangle_parts,
        origin=int(middle),
    )


def _build(template: BodyTemplate, device: torch.device, dtype: torch.dtype) -> Tables:
    maps = matrices(template)

    def rows(matrix: Any, group: int = 8) -> SparseRows:
        matrix = matrix.tocsr()
        matrix.sort_indices()
        return sparse_rows(matrix, device, dtype, group)

    return Tables(
        origin=maps.origin,
        rest=torch.tensor(template.vertices, device=device, dtype=dtype),
        corners=torch.tensor(maps.triangles.T.ravel(), device=device),
        triangle_parts=torch.tensor(maps.triangle_parts, device=device),
        part_sizes=torch.tensor(np.bincount(template.sample_parts, minlength=template.num_parts), device=device),
        centres=rows(maps.centres),
        centres_back=rows(maps.centres.T),
        incidence=rows(maps.incidence),
        parts=rows(maps.parts, group=64),
        samples=rows(maps.samples),
        samples_back=rows(maps.samples.T),
        sample_sums=rows(maps.sample_sums, group=64),
        sample_sums_back=rows(maps.sample_sums.T),
    )


_tables = PerTemplate(_build)


@assume_constant_result
def tables(template: BodyTemplate, device: torch.device, dtype: torch.dtype) -> Tables:
    """The gather tables of `template`, built at the first call."""
    return _tables(template, device, dtype)
