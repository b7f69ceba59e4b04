"""Static people of the embedded body, seen as keypoints: a source that needs no files."""

from __future__ import annotations

from dataclasses import fields

import numpy as np
import torch
from torch import Tensor

from ...synthetic.population import draw_population
from ..batch import Batch
from ..lifting.views import add_noise, views
from ..tilted_labels import tilt_labels


class People:
    """`count` people of a seed, an image each; labels lean by `tilt` degrees."""

    def __init__(self, count: int, seed: int, tilt: float = 0.0) -> None:
        self.views = tilt_labels(views(draw_population(count, seed), seed), tilt, seed)

    def __len__(self) -> int:
        return len(self.views)

    def sample(self, row: int, draw: np.random.Generator | None) -> dict[str, Tensor]:
        one = self.views[slice(row, row + 1)]
        if draw is not None:
            one = add_noise(one, torch.Generator().manual_seed(int(draw.integers(2**63))))
        return {field.name: getattr(one, field.name)[0] for field in fields(Batch)}
