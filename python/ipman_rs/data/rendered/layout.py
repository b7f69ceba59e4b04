"""How a folder of rendered images is laid out.

    index.json  train-000000.tar  train-000001.tar  val-000000.tar  test-000000.tar

The shards are WebDataset's: the files of a sample follow each other, named by its key and what they are. The index says
which shards there are to be, what they were made with, and the names of the keypoints.
"""

from __future__ import annotations

import os
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from ipman_rs.files import read_json

INDEX = "index.json"
FORMAT = "ipman_rs rendered images, 1"
SPLITS = ("train", "val", "test")


@dataclass(frozen=True)
class Shard:
    """The samples `first` to `first` + `count` of a split."""

    name: str
    split: str
    first: int
    count: int

    @property
    def keys(self) -> list[str]:
        return [key_of(self.split, number) for number in range(self.first, self.first + self.count)]


def key_of(split: str, number: int) -> str:
    return f"{split}-{number:08d}"


def plan(counts: dict[str, int], shard_size: int) -> list[Shard]:
    """The shards of so many images of each split."""
    return [
        Shard(f"{split}-{number:06d}.tar", split, first, min(shard_size, counts[split] - first))
        for split in SPLITS
        for number, first in enumerate(range(0, counts.get(split, 0), shard_size))
    ]


def read_index(folder: Path) -> dict[str, Any]:
    """The index of a folder. ValueError, saying what is wrong, if it has none."""
    path = folder / INDEX
    if not os.path.lexists(path):
        raise ValueError(f"{folder}: no {INDEX}; expected a folder that `ipman data render` wrote")
    index = read_json(path)
    try:
        if index["format"] != FORMAT:
            raise ValueError(f"expected the format {FORMAT!r}, got {index['format']!r}")
        if not {"settings", "counts", "keypoint_names"} <= set(index):
            raise ValueError("expected settings, counts and keypoint_names")
        shards_of(index)
    except (ValueError, LookupError, TypeError) as error:
        raise ValueError(f"{path}: no index of rendered images: {error}") from None
    return index


def shards_of(index: dict[str, Any]) -> list[Shard]:
    return [Shard(**shard) for shard in index["shards"]]
