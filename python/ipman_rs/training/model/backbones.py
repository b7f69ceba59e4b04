"""Encoders by name: images (B, 3, H, W) -> features (B, F)."""

from __future__ import annotations

import importlib
from typing import Any

import torch
from torch import Tensor, nn

PREFIX = "timm/"


def backbone(name: str = "resnet50", pretrained: bool = False) -> tuple[nn.Module, int]:
    """An encoder and its number of features.

    name: "small" (a network of this project, for CPUs), a classifier of torchvision such as "resnet50", or "timm/" and
    a model of timm. pretrained: with the weights that torchvision or timm download.

    Raises:
        ValueError: there is no such model, or pretrained weights of "small" are asked for.
        ImportError: torchvision or timm is missing.
    """
    if name == "small":
        if pretrained:
            raise ValueError("pretrained: the backbone 'small' has no weights to start from")
        return Small(), Small.FEATURES
    if name.startswith(PREFIX):
        return _timm(name.removeprefix(PREFIX), pretrained)
    return _torchvision(name, pretrained)


class Small(nn.Module):
    """For CPUs: 1.5 milliseconds of one core for an image of 96 pixels, with the way back. Where in the image something
    is says how a body is posed: so maps at an eighth of the resolution, with context from a sixteenth and a
    thirty-second, and the mean position in each. Groups are normalised, not batches: a sample's features do not depend
    on its batch."""

    CHANNELS = (32, 64, 128, 192)
    MAPS = 48
    FEATURES = 256

    def __init__(self) -> None:
        super().__init__()
        first, fine, coarse, coarsest = self.CHANNELS
        self.stem = nn.Sequential(nn.Conv2d(3, first, 7, stride=4, padding=3), nn.ReLU())
        self.fine = nn.Sequential(_convolution(first, fine, 2), _convolution(fine, fine))
        self.coarse = nn.Sequential(_convolution(fine, coarse, 2), _convolution(coarse, coarse))
        self.coarsest = nn.Sequential(_convolution(coarse, coarsest, 2), _convolution(coarsest, coarsest))
        self.to_coarse, self.to_fine = nn.Conv2d(coarsest, coarse, 1), nn.Conv2d(coarse, fine, 1)
        self.coarse_joined, self.fine_joined = _convolution(coarse, coarse), _convolution(fine, fine)
        self.to_maps = nn.Conv2d(fine, self.MAPS, 1)
        self.mix = nn.Sequential(nn.Linear(2 * self.MAPS + coarse, self.FEATURES), nn.ReLU())

    def forward(self, images: Tensor) -> Tensor:
        return self.features(*self.maps(images))

    def maps(self, images: Tensor) -> tuple[Tensor, Tensor]:
        """Log-probabilities but for a constant (B, 48, H/8, W/8), and the coarse features (B, 128, H/16, W/16)."""
        fine = self.fine(self.stem(images))
        coarse = self.coarse(fine)
        coarse = self.coarse_joined(coarse + _enlarged(self.to_coarse(self.coarsest(coarse)), coarse))
        fine = self.fine_joined(fine + _enlarged(self.to_fine(coarse), fine))
        return self.to_maps(fine), coarse

    def features(self, maps: Tensor, coarse: Tensor) -> Tensor:
        """(B, 256) of what `maps` gave."""
        return self.mix(torch.cat([mean_positions(maps).flatten(1), coarse.mean(dim=(2, 3))], dim=1))


def mean_positions(maps: Tensor) -> Tensor:
    """Of the distribution that each of the maps (B, M, h, w) is the logarithm of: x, y (B, M, 2), in half sides."""
    share = maps.flatten(2).softmax(dim=2).unflatten(2, maps.shape[2:])
    y, x = (torch.linspace(-1, 1, size, dtype=maps.dtype, device=maps.device) for size in maps.shape[2:])
    return torch.stack([(share.sum(dim=2) * x).sum(dim=2), (share.sum(dim=3) * y).sum(dim=2)], dim=2)


def _enlarged(maps: Tensor, other: Tensor) -> Tensor:
    """To the other's height and width."""
    return nn.functional.interpolate(maps, size=other.shape[2:])


def _convolution(before: int, after: int, stride: int = 1) -> nn.Sequential:
    return nn.Sequential(
        nn.Conv2d(before, after, 3, stride=stride, padding=1, bias=False), nn.GroupNorm(8, after), nn.ReLU()
    )


def _torchvision(name: str, pretrained: bool) -> tuple[nn.Module, int]:
    models = _module("torchvision.models")
    if name not in models.list_models():
        raise ValueError(
            f"backbone: expected 'small', a model of torchvision or 'timm/NAME', got {name!r}; "
            "torchvision.models.list_models() lists the first, timm.list_models() the second"
        )
    return _headless(models.get_model(name, weights="DEFAULT" if pretrained else None), name)


def _headless(network: Any, name: str) -> tuple[nn.Module, int]:
    """The network without its classifier: the features that went into it."""
    for attribute in ("fc", "classifier", "heads", "head"):
        head = getattr(network, attribute, None)
        linear = next((part for part in head.modules() if isinstance(part, nn.Linear)), None) if head else None
        if linear is not None:
            setattr(network, attribute, nn.Identity())
            return network, linear.in_features
    raise ValueError(f"backbone: {name!r} is no classifier whose head can be taken off")


def _timm(name: str, pretrained: bool) -> tuple[nn.Module, int]:
    timm = _module("timm")
    if name not in timm.list_models():
        raise ValueError(f"backbone: timm has no model {name!r}; timm.list_models() lists them")
    network = timm.create_model(name, pretrained=pretrained, num_classes=0)
    with torch.no_grad():
        size = network.pretrained_cfg.get("input_size", (3, 224, 224))
        features = network.eval()(torch.zeros(1, *size)).shape[1]
    return network.train(), features


def _module(name: str) -> Any:
    try:
        return importlib.import_module(name)
    except ImportError as error:
        package = name.partition(".")[0]
        raise ImportError(f"{package} is needed for this backbone: pip install 'ipman_rs[train]'") from error
