"""Presented contact (SMPLify-XMC): what touches in the presented pose touches again,

    mean over i of tanh(min_j |v_i − v_j|)     metres

over the presented contact vertices i, where j is any vertex that is more than 0.3 m away from i along the surface
(`geodesics`). A pose in which nothing touches costs 0.
"""

from __future__ import annotations

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor

from ipman_rs.checks import positive

from ..candidate import Candidate
from ..geodesics import geodesics
from ..problem import Problem
from .term import Term


class PresentedContact(Term):
    """geodesic: metres along the surface from where on two vertices count as different places."""

    needs_mesh = True

    def __init__(self, problem: Problem, geodesic: float = 0.3):
        super().__init__(problem)
        geodesic, count = positive("geodesic", geodesic), problem.body.template.num_vertices
        self.pairs: list[tuple[Tensor, Tensor]] = []  # of each body, or one for all: contact (n,), too near (n, V)
        for contact in _given(problem):
            if contact.size and not 0 <= contact.min() <= contact.max() < count:
                raise ValueError(f"presented_contact: expected indices of vertices, 0 to {count - 1}")
            far = geodesics(problem.body.template, geodesic).rows(contact)
            partnered = far.any(axis=1)
            self.pairs.append((torch.from_numpy(contact[partnered]), torch.from_numpy(~far[partnered])))

    def cost(self, candidate: Candidate) -> Tensor:
        bodies = candidate.variables["transl"]
        if not any(len(contact) for contact, _ in self.pairs):
            return bodies.new_zeros(len(bodies))
        pairs = self.pairs * (len(bodies) if len(self.pairs) == 1 else 1)
        return torch.stack([_mean(body, *pair) for body, pair in zip(candidate.vertices, pairs, strict=True)])


def _given(problem: Problem) -> list[NDArray[np.int64]]:
    """The contact vertices of each body, or those of all in one."""
    if problem.presented is None or problem.presented.contact is None:
        return []
    given = problem.presented.contact.numpy(force=True)
    if given.dtype == bool and given.ndim == 2:
        return [np.flatnonzero(row) for row in given]
    if given.ndim != 1 or (given.size and given.dtype.kind not in "iu"):
        raise ValueError(
            "presented_contact: expected indices (n,) of vertices, or one bool a body and vertex, got "
            f"{given.dtype} of shape {given.shape}"
        )
    return [np.unique(given).astype(np.int64)]


def _mean(vertices: Tensor, contact: Tensor, near: Tensor) -> Tensor:
    """The cost of one body (V, 3)."""
    if not len(contact):
        return vertices.new_zeros(())
    offset = vertices[contact] - vertices[_nearest(vertices.detach(), contact, near)]
    x, y, z = offset.unbind(-1)
    squared = x * x + y * y + z * z
    apart = squared > 0
    distance = torch.where(apart, torch.where(apart, squared, 1).sqrt(), 0)  # no gradient where they coincide
    return distance.tanh().mean()


def _nearest(vertices: Tensor, contact: Tensor, near: Tensor) -> Tensor:
    """(n,) which of the vertices (V, 3) of one body is the nearest far one of each contact vertex."""
    squared = sum((own[:, None] - axis).square() for own, axis in zip(vertices[contact].T, vertices.T, strict=True))
    return torch.as_tensor(squared).masked_fill(near, torch.inf).argmin(dim=1)
