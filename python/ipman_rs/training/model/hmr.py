"""HMR: an encoder and the iterative regressor."""

from __future__ import annotations

from typing import cast

from torch import Tensor, nn

from .backbones import Small, backbone
from .mean_parameters import MeanParameters
from .regressor import Estimate, Regressor


class HMR(nn.Module):
    """Inputs -> Estimate.

    encoder: a module from inputs to features (B, `features`), such as `backbone(...)` gives.
    """

    def __init__(
        self, encoder: nn.Module, features: int, mean: MeanParameters, hidden: int = 1024, dropout: float = 0.5
    ) -> None:
        super().__init__()
        self.encoder = encoder
        self.regressor = Regressor(features, mean, hidden, dropout)

    @classmethod
    def of_images(cls, mean: MeanParameters, name: str = "resnet50", pretrained: bool = False) -> HMR:
        """The regressor of the paper: images (B, 3, 224, 224), normalised as ImageNet's, through a named backbone.

        Raises as `backbone`.
        """
        return cls(*backbone(name, pretrained), mean)

    def forward(self, inputs: Tensor) -> Estimate:
        return self.regressor(self.encoder(inputs))

    def with_maps(self, inputs: Tensor) -> tuple[Estimate, Tensor]:
        """The estimate, and the maps (B, M, h, w) of the backbone "small" which it came of."""
        encoder = cast("Small", self.encoder)
        maps, coarse = encoder.maps(inputs)
        return self.regressor(encoder.features(maps, coarse)), maps
