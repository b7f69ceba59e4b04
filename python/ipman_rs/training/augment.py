"""Flip, turn, scale and colour of training images, and what the labels become.

The image is turned clockwise about the middle of its crop, then mirrored left to right. Labels of the body follow; the
camera is left as it was, with `flip` and `turn` beside it, from which `world.to_world` makes the one that sees the
augmented image. (A camera that does not follow lays the body's weight to the side of its feet.)
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
import torch
from numpy.typing import NDArray
from PIL import Image
from torch import Tensor

Array = NDArray[np.floating]
Pixels = NDArray[np.uint8]

ROOM = 1.2  # side of a crop over the longer side of its box
MEAN, SPREAD = (0.485, 0.456, 0.406), (0.229, 0.224, 0.225)  # of ImageNet's colours


@dataclass(frozen=True)
class Augmentation:
    """One drawing. degrees: clockwise. scale: of the crop's side. gains: of the three colours."""

    flip: bool = False
    degrees: float = 0.0
    scale: float = 1.0
    gains: tuple[float, float, float] = (1.0, 1.0, 1.0)

    @property
    def turn(self) -> float:
        return float(np.radians(self.degrees))

    def matrix(self) -> Array:
        """What the picture does to directions (x right, y down, z forward): (3, 3), a reflection where flipped."""
        cosine, sine, side = np.cos(self.turn), np.sin(self.turn), -1.0 if self.flip else 1.0
        return np.array([[side * cosine, -side * sine, 0.0], [sine, cosine, 0.0], [0.0, 0.0, 1.0]])


@dataclass(frozen=True)
class AugmentConfig:
    """How strongly images are changed; the defaults are SPIN's.

    flip: probability. degrees, scale: standard deviations, cut at twice them; only `turned` of the images are turned at
    all. noise: gains lie in 1 ± noise.
    """

    flip: float = 0.5
    degrees: float = 30.0
    turned: float = 0.4
    scale: float = 0.25
    noise: float = 0.4

    def draw(self, draw: np.random.Generator) -> Augmentation:
        # All numbers are drawn always, so that one setting does not change what another draws.
        flip, turned = draw.uniform(size=2)
        degrees, scale = draw.standard_normal(2).clip(-2, 2)
        red, green, blue = draw.uniform(1 - self.noise, 1 + self.noise, 3).tolist()
        return Augmentation(
            bool(flip < self.flip),
            float(self.degrees * degrees) if turned < self.turned else 0.0,
            float(np.clip(1 + self.scale * scale, 1 - self.scale, 1 + self.scale)),
            (red, green, blue),
        )


def to_crop(box: Sequence[float], change: Augmentation) -> Array:
    """The affine map (2, 3) from pixels of the image to half sides of the augmented crop, from its middle.

    box: x, y, width, height in pixels. ValueError for one that is empty or not finite.
    """
    x, y, width, height = (float(number) for number in box)
    side = ROOM * max(width, height) * change.scale
    if not (np.isfinite([x, y, side]).all() and side > 0):
        raise ValueError(f"box: expected finite x, y, width, height with a positive size, got {list(box)}")
    linear = change.matrix()[:2, :2] * (2 / side)
    return np.column_stack([linear, -linear @ [x + width / 2, y + height / 2]])


def augmented_crop(image: Image.Image, box: Sequence[float], change: Augmentation, size: int) -> Pixels:
    """The augmented crop (size, size, 3), in the image's colours; black beyond the image."""
    whole = to_crop(box, change)
    shrink = max(1, int(2 / np.linalg.norm(whole[:, 0]) / size))  # image pixels under one of the crop
    if shrink > 1:
        image = image.reduce(shrink)
    # Centres of pixels lie at ½; the image was shrunk, the crop has `size` pixels on two half sides.
    linear, shift = whole[:, :2] * shrink * size / 2, (whole[:, 2] + 1) * size / 2
    back = np.linalg.inv(linear)
    inverse = np.column_stack([back, -back @ shift]).ravel()
    return np.array(
        image.convert("RGB").transform(
            (size, size), Image.Transform.AFFINE, inverse.tolist(), Image.Resampling.BILINEAR
        )
    )


def normalised(pixels: Tensor, gains: Tensor) -> Tensor:
    """Crops (B, S, S, 3) uint8 as inputs (B, 3, S, S): colours times `gains` (B, 3), normalised as ImageNet's."""
    colours = (pixels * (gains / 255.0)[:, None, None]).clamp(0, 1)
    return ((colours - gains.new_tensor(MEAN)) / gains.new_tensor(SPREAD)).permute(0, 3, 1, 2).float()


def crop(image: Image.Image, box: Sequence[float], change: Augmentation, size: int) -> Tensor:
    """The augmented crop (3, size, size) as a network takes it."""
    gains = torch.tensor([change.gains], dtype=torch.float64)
    return normalised(torch.from_numpy(augmented_crop(image, box, change, size))[None], gains)[0]


def augment_labels(
    labels: Mapping[str, Tensor], whole: Array, change: Augmentation, keypoints: Sequence[str], joints: Sequence[str]
) -> dict[str, Tensor]:
    """Labels of one person for the augmented crop: fields of `Batch`, less inputs.

    Of the image: keypoints (K, 3) in pixels, joints (N, 4) and pose (J, 3, 3) of the first J of them in the axes of its
    camera; the names say what lies on which side. `whole` is what `to_crop` gave.
    """
    matrix = torch.from_numpy(change.matrix()).float()
    side = torch.diag(torch.tensor([-1.0 if change.flip else 1.0, 1.0, 1.0]))
    affine = torch.from_numpy(whole).float()
    points = labels["keypoints"][_order(keypoints, change.flip)]
    placed = torch.cat([points[:, :2] @ affine[:, :2].T + affine[:, 2], points[:, 2:]], dim=1)
    moved = labels["joints"][_order(joints, change.flip)]
    pose = side @ labels["pose"][_order(joints[: len(labels["pose"])], change.flip)] @ side
    pose[0] = matrix @ labels["pose"][0] @ side
    return {
        **labels,
        "keypoints": placed,
        "joints": torch.cat([moved[:, :3] @ matrix.T, moved[:, 3:]], dim=1),
        "pose": pose,
        "flip": torch.tensor(change.flip),
        "turn": torch.tensor(change.turn),
    }


def _order(names: Sequence[str], flip: bool) -> list[int]:
    """Where each point's label is found: on the other side if flipped."""
    if not flip:
        return list(range(len(names)))
    swap = {"left": "right", "right": "left"}
    others = ["_".join([swap.get(name.partition("_")[0], ""), name.partition("_")[2]]) for name in names]
    return [names.index(other) if other in names else index for index, other in enumerate(others)]
