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
    """Six 3 × 3 convolutions, each halving the image but for the first's quarter; a step on one core takes tenths of a
    second. Groups are normalised, not batches: a sample's features do not depend on its batch."""

    CHANNELS = (32, 64, 96, 128, 192)
    FEATURES = 2 * 192

    def __init__(self) -> None:
        super().__init__()
        layers: list[nn.Module] = [nn.Conv2d(3, self.CHANNELS[0], 7, stride=4, padding=3), nn.ReLU()]
        for before, after in zip(self.CHANNELS, self.CHANNELS[1:], strict=False):
            layers += [nn.Conv2d(before, after, 3, stride=2, padding=1, bias=False), nn.GroupNorm(8, after), nn.ReLU()]
        self.layers = nn.Sequential(*layers)
        # Where in the image something is says how the body is posed: pooled over rows and columns, not over all.
        self.mix = nn.Sequential(nn.AdaptiveAvgPool2d(4), nn.Flatten(), nn.Linear(16 * 192, self.FEATURES), nn.ReLU())

    def forward(self, images: Tensor) -> Tensor:
        return self.mix(self.layers(images))


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
