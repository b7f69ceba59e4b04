"""The regressor that a configuration asks for."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from ipman_rs.body import BodyModel

from .backbones import backbone
from .hmr import HMR
from .mean_parameters import MeanParameters
from .spin_checkpoint import load_spin

if TYPE_CHECKING:
    from ..trainer.config import Config


def made(settings: Config, body: BodyModel, start: bool = True) -> HMR:
    """start: with the weights and mean parameters that it is to start from; without, those of a checkpoint follow.

    ValueError for files that do not fit, and unknown backbones.
    """
    from ..lifting.network import WIDTH, KeypointEncoder

    told = settings.model
    mean = MeanParameters.read(Path(told.mean)) if told.mean and start else MeanParameters.of(body)
    if told.backbone == "keypoints":
        return HMR(KeypointEncoder(), WIDTH, mean, hidden=WIDTH, dropout=told.dropout)
    model = HMR(*backbone(told.backbone, told.pretrained and start), mean, dropout=told.dropout)
    if told.spin and start:
        load_spin(model, told.spin)
    return model
