"""Posed bodies of one template: what every formula starts from."""

from __future__ import annotations

from typing import TYPE_CHECKING

from torch import Tensor

from .topology import topology

if TYPE_CHECKING:
    from ipman_rs import BodyTemplate


class Posed:
    """vertices (B, V, 3), m, of a template, with its index tensors `mesh` on their device."""

    def __init__(self, vertices: Tensor, template: BodyTemplate) -> None:
        self.vertices = vertices
        self.template = template
        self.mesh = topology(template, vertices.device)
        self._samples: Tensor | None = None  # not a cached_property: its lock stops torch.compile

    @property
    def samples(self) -> Tensor:
        """v_i = (W V)_i, points drawn once on the template and carried along: (B, S, 3), m; formed once."""
        if self._samples is None:
            weights = self.mesh.barycentric.to(self.vertices.dtype)
            a, b, c = (self.vertices.index_select(-2, self.mesh.samples[:, k]) * weights[:, k, None] for k in range(3))
            self._samples = a + b + c
        return self._samples
