"""The interface of a source of training samples."""

from __future__ import annotations

from typing import Protocol

import numpy as np
from torch import Tensor


class BadSample(ValueError):
    """A sample that cannot be used; says which and why. Another is taken in its place."""


class Source(Protocol):
    def __len__(self) -> int: ...

    def sample(self, row: int, draw: np.random.Generator | None) -> dict[str, Tensor]:
        """The fields of `Batch` of one person, augmented as `draw` decides, or as it is. Raises BadSample."""
        ...
