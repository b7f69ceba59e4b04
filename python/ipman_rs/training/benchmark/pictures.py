"""The ablation on HMR with the small backbone, on images that `ipman data render` drew."""

from __future__ import annotations

import dataclasses
import os
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any, cast

import numpy as np
import torch
from torch import Tensor

import ipman_rs.data
import ipman_rs.torch as ipt
from ipman_rs.body import load_body
from ipman_rs.data.rendered import Rendered

from ..augment import Augmentation, Augmenting, normalised
from ..batch import Batch
from ..lifting.views import KEYPOINTS
from ..model import HMR, MeanParameters, keypoint_maps_loss
from ..model.backbones import Small, backbone
from ..posing import Posing
from ..sources import BadSample
from ..sources.images import Images
from .task import Progress, key_of

SPLITS = {"test": "test", "tune": "val"}
SIZE = 96  # pixels of a crop
CUTS = 2  # of each image that is trained on, flipped, turned and scaled by themselves
AUGMENTING = Augmenting(degrees=30.0, turned=1.0, scale=0.1, noise=0.2)
HIDDEN = 512


@dataclass(frozen=True)
class Pictures:
    """images: a folder of `ipman data render`. others: another one, whose images figures are taken of. folder: where
    crops are kept."""

    folder: Path
    images: Path
    split: str = "test"
    others: Path | None = None
    name: str = "images"

    def trained_on(self) -> dict[str, Any]:
        index = self._data("train").index
        return {
            "name": self.name, "size": SIZE, "cuts": CUTS, "augmenting": dataclasses.asdict(AUGMENTING),
            "rendered": index["settings"], "images": index["counts"]["train"],
        }  # fmt: skip

    def tested_on(self) -> dict[str, Any]:
        index = self._tested().index
        count = index["counts"][SPLITS[self.split]]
        return {"split": self.split, "test_rendered": index["settings"], "test_images": count}

    def make(self, progress: Progress | None = None) -> None:
        for place, data, cuts in ((self._place(), self._data("train"), CUTS), (self._test_place(), self._tested(), 0)):
            if not place.exists():
                _save(_cut(data, cuts, progress), place)

    def training(self) -> Batch:
        return _kept(self._place())

    def truth(self) -> Batch:
        """Of the static people: the others have no balance to be judged."""
        kept = _kept(self._test_place())
        static = kept[kept.standing]
        return dataclasses.replace(static, inputs=normalised(static.inputs, torch.ones(len(static), 3)))

    def noisy(self, batch: Batch, generator: torch.Generator) -> Batch:
        """Each colour brighter or darker."""
        gains = 1 + AUGMENTING.noise * (2 * torch.rand(len(batch), 3, generator=generator) - 1)
        return dataclasses.replace(batch, inputs=normalised(batch.inputs, gains))

    def network(self, seed: int) -> HMR:
        with torch.random.fork_rng(devices=[]):
            torch.manual_seed(seed)
            mean = MeanParameters.of(load_body(self._data("train").index["settings"]["body"]))
            return HMR(*backbone("small"), mean, hidden=HIDDEN, dropout=0.0)

    def first_loss(self, model: HMR, batch: Batch) -> Tensor:
        """Where the keypoints are."""
        return keypoint_maps_loss(cast("Small", model.encoder).maps(batch.inputs)[0], batch.keypoints)

    def posing(self) -> Posing:
        return Posing(ipt.BodyModel(self._data("train").index["settings"]["body"]), KEYPOINTS)

    def _data(self, split: str, folder: Path | None = None) -> Rendered:
        return ipman_rs.data.open("rendered", folder or self.images, split=split)  # type: ignore[return-value]

    def _tested(self) -> Rendered:
        return self._data(SPLITS[self.split], self.others)

    def _place(self) -> Path:
        return self.folder / f"crops-{key_of(self.trained_on())}.pt"

    def _test_place(self) -> Path:
        return self.folder / f"crops-{key_of([SIZE, self.tested_on()])}.pt"


def _kept(place: Path) -> Batch:
    """From the file, which processes share in memory."""
    return Batch(**torch.load(place, weights_only=True, mmap=True))


def _cut(data: Rendered, cuts: int, progress: Progress | None) -> Batch:
    """Crops (n, S, S, 3) uint8 of all images that can be read: `cuts` augmented ones of each, or one as it is."""
    source = Images(data, load_body(data.index["settings"]["body"]), KEYPOINTS, SIZE, AUGMENTING)
    samples = []
    for row in range(len(data)):
        for change in _changes(row, cuts):
            try:
                pixels, labels = source.cut(row, change)
            except BadSample:
                continue  # it was warned of
            samples.append({**labels, "inputs": torch.from_numpy(pixels)})
        if progress is not None:
            progress(row + 1, len(data))
    return Batch.of(samples).sound()


def _changes(row: int, cuts: int) -> Iterator[Augmentation]:
    if cuts == 0:
        yield Augmentation()
    for number in range(cuts):
        yield AUGMENTING.draw(np.random.default_rng([row, number]))


def _save(batch: Batch, path: Path) -> None:
    path.parent.mkdir(parents=True, exist_ok=True)
    beside = path.with_suffix(".part")
    torch.save(vars(batch), beside)
    os.replace(beside, path)
