"""Contact normals (SMPLify-XMC's face-angle term): surfaces that touch face each other,

    Σ 1 + n_i · n_j

over the template's samples i that are nearer than `near` to opposite surface, j the nearest opposite sample and n the
normals of the faces that they lie on. Opposite is what is farther than `geodesic` along the surface (`geodesics`).
Which samples these are is decided anew for every pose and not differentiated.

A search takes 20 ms per body; so it also collects pairs that are a little farther apart, and only these are evaluated
until the body has moved so far that others may touch (a Verlet list). This changes only the time.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
import torch
from numpy.typing import NDArray
from scipy.spatial import KDTree
from torch import Tensor

from ipman_rs import BodyTemplate
from ipman_rs.checks import positive

from ..candidate import Candidate
from ..geodesics import geodesics
from ..problem import Problem
from .term import Term

SLACK = 0.01  # m
Indices = NDArray[np.int64]
Array = NDArray[np.floating]


class ContactNormals(Term):
    """near, geodesic: metres."""

    needs_mesh = True

    def __init__(self, problem: Problem, near: float = 0.005, geodesic: float = 0.3):
        super().__init__(problem)
        self.near, self.geodesic = positive("near", near), positive("geodesic", geodesic)
        self.template = problem.body.template
        self.faces = torch.tensor(self.template.faces)
        self.pairs: dict[int, Pairs] = {}  # by body

    def cost(self, candidate: Candidate) -> Tensor:
        return torch.stack([self._of(number, body) for number, body in enumerate(candidate.vertices)])

    def _of(self, number: int, vertices: Tensor) -> Tensor:
        if not vertices.isfinite().all():
            return vertices.new_tensor(torch.nan)
        place = vertices.detach().numpy()
        pairs = self.pairs.get(number)
        if pairs is None or not pairs.hold(place):
            pairs = self.pairs[number] = search(place, self.template, self.near + SLACK, self.geodesic)
        first, second = (self._normals(vertices, faces) for faces in touching(place, self.template, pairs, self.near))
        return (1 + (first * second).sum(dim=-1)).sum()

    def _normals(self, vertices: Tensor, faces: Indices) -> Tensor:
        """Unit normals (n, 3) of faces (n,), 0 of those without area."""
        a, b, c = vertices[self.faces[faces]].unbind(1)
        normal = torch.linalg.cross(b - a, c - a)
        squared = normal.square().sum(dim=-1, keepdim=True)
        return normal * torch.where(squared > 0, torch.where(squared > 0, squared, 1).rsqrt(), 0)


@dataclass(frozen=True)
class Pairs:
    """All opposite samples (2, n) that were near each other where a body's vertices were at `place` (V, 3)."""

    place: Array
    samples: Indices

    def hold(self, place: Array) -> bool:
        """Whether no others can have come near: two samples approach by twice what a vertex moves."""
        return bool(np.square(place - self.place).sum(axis=1).max() < (0.499 * SLACK) ** 2)


def search(place: Array, template: BodyTemplate, distance: float, geodesic: float) -> Pairs:
    """The opposite samples of a body (V, 3) within a distance."""
    _, corners, _ = samples = _samples(template)
    points = _points(place, samples, slice(None))
    first, second = KDTree(points).query_pairs(distance, output_type="ndarray").T
    shared = (corners[first, :, None] == corners[second, None]).any(axis=(1, 2))  # a vertex: not worth a search
    first, second = first[~shared], second[~shared]
    far = geodesics(template, geodesic).far(corners[first, 0], corners[second, 0])
    return Pairs(place.copy(), np.stack([first[far], second[far]]))


def touching(place: Array, template: BodyTemplate, pairs: Pairs, near: float) -> Indices:
    """The faces (2, n) of the samples that are nearer than `near` to opposite ones, and of those that are nearest."""
    faces, _, _ = samples = _samples(template)
    x, y, z = (_points(place, samples, pairs.samples[0]) - _points(place, samples, pairs.samples[1])).T
    squared = x * x + y * y + z * z
    close = squared < near * near
    i, j = np.concatenate([pairs.samples[:, close], pairs.samples[::-1, close]], axis=1)
    order = np.lexsort([j, np.tile(squared[close], 2), i])
    i, j = i[order], j[order]
    nearest = np.diff(i, prepend=-1) > 0
    return np.stack([faces[i[nearest]], faces[j[nearest]]])


def _points(place: Array, samples: tuple[Indices, Indices, Array], rows: Indices | slice) -> Array:
    """The places of some samples; each by itself, so that none depends on which others are asked for."""
    _, corners, weights = samples
    a, b, c = (weights[rows, k, None] * place[corners[rows, k]] for k in range(3))
    return a + b + c


@lru_cache(maxsize=16)
def _samples(template: BodyTemplate) -> tuple[Indices, Indices, Array]:
    """Of the template's samples: their faces (S,), the vertices of these (S, 3), and their weights (S, 3)."""
    faces = template.sample_faces
    return faces, template.faces[faces], template.sample_barycentric


__all__ = ["ContactNormals"]
