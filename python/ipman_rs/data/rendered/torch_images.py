"""Rendered images for a torch DataLoader."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import torch
from torch.utils.data import Dataset

from .reader import BadSample, Rendered


class RenderedImages(Dataset):
    """Items are dicts: "image" (3, S, S) uint8 RGB, the arrays of `ipman_rs.data.rendered` as tensors, "name", and the
    flags "static" and "contact".

    A bad sample is warned of and replaced by the next good one: batches stay full, and the others in their order.
    `data.bad`, of the process that read it, has its name. ValueError if there is no good one.
    """

    def __init__(self, folder: Path, split: str):
        self.data = Rendered(folder, split)

    def __len__(self) -> int:
        return len(self.data)

    def __getitem__(self, row: int) -> dict[str, Any]:
        for step in range(len(self)):
            try:
                return self.item((row + step) % len(self))
            except BadSample:
                continue
        raise ValueError(f"{self.data.folder}: no sample can be read")

    def item(self, row: int) -> dict[str, Any]:
        """Sample `row` itself. BadSample if it cannot be read."""
        labels, image = self.data.labels(row), torch.from_numpy(self.data.image(row).copy())
        return {
            "name": str(self.data.names[row]),
            "image": image.permute(2, 0, 1),
            **{name: torch.from_numpy(value) for name, value in labels.arrays.items()},
            "static": labels.static,
            "contact": labels.touching,
        }
