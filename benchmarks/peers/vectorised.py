"""(b) Vectorised eager torch with autograd: the package's own reference formulas, the path of other devices."""

from __future__ import annotations

from torch import Tensor

from ipman_rs.torch.dispatch import _reference_path

from .ours import Ours


class Vectorised(Ours):
    def terms(self, vertices: Tensor) -> Tensor:
        with _reference_path():
            return super().terms(vertices)

    def weighted(self, vertices: Tensor) -> Tensor:
        with _reference_path():
            return super().weighted(vertices)
