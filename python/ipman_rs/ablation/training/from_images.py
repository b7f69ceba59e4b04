"""The ablation on images that `ipman data render` drew: the small backbone learns where keypoints are, and the
regressor from keypoints is trained on its detections."""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass
from pathlib import Path
from typing import Any, BinaryIO

import numpy as np
import torch
from torch import Tensor, nn

import ipman_rs.data
import ipman_rs.torch as ipt
from ipman_rs.body import load_body
from ipman_rs.data.rendered import Rendered
from ipman_rs.files import atomic_write

from ...training.augment import AugmentConfig, normalised
from ...training.batch import Batch
from ...training.lifting.network import lifting_network
from ...training.model import HMR, keypoint_maps_loss
from ...training.model.backbones import Small, mean_positions
from ...training.model.keypoint_encoder import KEYPOINTS
from ...training.posed_estimate import Posing
from ...training.sources import BadSample
from ...training.sources.images import Images
from ...training.train_loop import AT_ONCE, TrainingPlan, run_plan
from .task import Progress, key_of

SPLITS = {"test": "test", "tune": "val"}
SIZE = 96  # pixels of a crop
CUTS = 2  # of each image that is trained on, flipped, turned and scaled by themselves; of others one
# At most, and new at each step: radians, share of the side, half sides across and down. Without it the backbone learns
# its cuts by heart, and what it finds in them is better than what it finds in others.
JITTER = (0.26, 0.12, 0.1, 0.1)
AUGMENTING = AugmentConfig(degrees=30.0, turned=1.0, scale=0.1, noise=0.2)
WIDTH, BLOCKS = 512, 2  # of the regressor from keypoints: what is found has more to be made out than what is given


@dataclass(frozen=True)
class ImageTask:
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
            "rendered": index["settings"], "images": index["counts"]["train"], "placed_by": "hips",
        }  # fmt: skip

    def tested_on(self) -> dict[str, Any]:
        index = self._tested().index
        count = index["counts"][SPLITS[self.split]]
        return {
            "split": self.split, "test_rendered": index["settings"], "test_images": count,
            "test_augmenting": dataclasses.asdict(AUGMENTING),
        }  # fmt: skip

    def make(self, progress: Progress | None = None) -> None:
        for place, data, cuts in ((self._place(), self._data("train"), CUTS), (self._test_place(), self._tested(), 1)):
            if not place.exists():
                _save(_cut(data, cuts, progress), place)

    def fit_backbone(self, seed: int, plan: TrainingPlan, file: BinaryIO) -> None:
        """The file gets the backbone, and the keypoints (n, K, 3) that it finds in the crops that are trained on."""
        with torch.random.fork_rng(devices=[]):
            torch.manual_seed(seed)
            eye = Small()
        crops = self.training()
        run_plan(
            eye, lambda batch: keypoint_maps_loss(eye.maps(batch.inputs)[0], batch.keypoints), crops, jitter, plan, seed
        )
        generator = torch.Generator().manual_seed(seed)
        parts = (crops[start : start + AT_ONCE] for start in range(0, len(crops), AT_ONCE))
        keypoints = torch.cat([detect_keypoints(eye, tint(part, generator)) for part in parts])
        torch.save({"backbone": eye.state_dict(), "keypoints": keypoints}, file)

    def training(self, seen: Path | None = None) -> Batch:
        """With what was seen as inputs, else with crops."""
        batch = _kept(self._place())
        return batch if seen is None else dataclasses.replace(batch, inputs=_read(seen)["keypoints"])

    def truth(self, seen: Path | None = None) -> Batch:
        """Of the static people: the others have no balance to be judged. Crops are turned as those that are trained on,
        or their frame would say where up is; and normalised."""
        batch = _kept(self._test_place())
        static = batch[batch.standing]
        crops = dataclasses.replace(static, inputs=normalised(static.inputs, torch.ones(len(static), 3)))
        if seen is None:
            return crops
        eye = Small()
        eye.load_state_dict(_read(seen)["backbone"])
        return dataclasses.replace(crops, inputs=detect_keypoints(eye, crops))

    def noisy(self, batch: Batch, generator: torch.Generator) -> Batch:
        """No added noise: detected keypoints already contain errors."""
        return batch

    def lifting_network(self, seed: int) -> HMR:
        return lifting_network(seed, self._data("train").index["settings"]["body"], WIDTH, BLOCKS)

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


def tint(crops: Batch, generator: torch.Generator) -> Batch:
    """Normalised, each colour brighter or darker."""
    gains = 1 + AUGMENTING.noise * (2 * torch.rand(len(crops), 3, generator=generator) - 1)
    return dataclasses.replace(crops, inputs=normalised(crops.inputs, gains))


def jitter(crops: Batch, generator: torch.Generator) -> Batch:
    """Tinted, and cut anew out of themselves: images and keypoints turned, scaled and shifted by up to JITTER."""
    crops = tint(crops, generator)
    draws = (2 * torch.rand(len(crops), len(JITTER), generator=generator) - 1) * torch.tensor(JITTER)
    turn, scale, shift = draws[:, 0], 1 + draws[:, 1], draws[:, 2:]
    cosine, sine = scale * turn.cos(), scale * turn.sin()
    back = torch.stack([cosine, -sine, sine, cosine], dim=1).unflatten(1, (2, 2))  # old place = back @ new + shift
    whole = torch.cat([back, shift[..., None]], dim=2)
    grid = nn.functional.affine_grid(whole, list(crops.inputs.shape), align_corners=False)
    inputs = nn.functional.grid_sample(crops.inputs, grid, padding_mode="border", align_corners=False)
    places = torch.linalg.solve(back, (crops.keypoints[..., :2] - shift[:, None]).mT).mT
    inside = (places.abs() <= 1).all(dim=2, keepdim=True)
    keypoints = torch.cat([places, crops.keypoints[..., 2:] * inside], dim=2)
    return dataclasses.replace(crops, inputs=inputs, keypoints=keypoints)


@torch.no_grad()
def detect_keypoints(eye: Small, crops: Batch) -> Tensor:
    """Keypoints (B, K, 3) at the means of their maps, with confidence 1."""
    eye.eval()
    places = torch.cat([mean_positions(eye.maps(part)[0]) for part in crops.inputs.split(AT_ONCE)])
    places = places[:, : crops.keypoints.shape[1]]
    return torch.cat([places, torch.ones_like(places[..., :1])], dim=2)


def _kept(place: Path) -> Batch:
    return Batch(**_read(place))


def _read(place: Path) -> dict[str, Any]:
    """From the file, which processes share in memory."""
    return torch.load(place, weights_only=True, mmap=True)


def _cut(data: Rendered, cuts: int, progress: Progress | None) -> Batch:
    """Crops (n, S, S, 3) uint8 of all images that can be read: `cuts` augmented ones of each."""
    source = Images(data, load_body(data.index["settings"]["body"]), KEYPOINTS, SIZE, AUGMENTING)
    samples = []
    for row in range(len(data)):
        for number in range(cuts):
            change = AUGMENTING.draw(np.random.default_rng([row, number]))
            try:
                pixels, labels = source.cut(row, change)
            except BadSample:
                continue  # it was warned of
            samples.append({**labels, "inputs": torch.from_numpy(pixels)})
        if progress is not None:
            progress(row + 1, len(data))
    return Batch.of(samples).sound()


def _save(batch: Batch, path: Path) -> None:
    path.parent.mkdir(parents=True, exist_ok=True)
    with atomic_write(path) as file:
        torch.save(vars(batch), file)
