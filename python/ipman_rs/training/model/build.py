"""The regressor that a configuration asks for."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from ipman_rs.body import BodyModel

from .backbones import backbone
from .hmr import HMR
from .keypoint_encoder import WIDTH, KeypointEncoder
from .mean_parameters import MeanParameters
from .spin_checkpoint import load_spin
from .trained_weights import read_trained

if TYPE_CHECKING:
    from ..trainer.config import Config


def build_model(settings: Config, body: BodyModel, start: bool = True) -> HMR:
    """start: with the weights and mean parameters that it is to start from; without, those of a checkpoint follow.

    ValueError for files that do not fit, and unknown backbones.
    """
    told = settings.model
    model = _made(settings, body, start)
    if told.start and start:
        _go_on_from(model, told.start)
    return model


def _go_on_from(model: HMR, path: str) -> None:
    settings, weights = read_trained(path)
    try:
        model.load_state_dict(weights)
    except RuntimeError:
        found = f"{settings['model']['backbone']} for {settings['body']}"
        raise ValueError(f"{path}: does not fit this model: it has the backbone {found}") from None


def _made(settings: Config, body: BodyModel, start: bool) -> HMR:
    told = settings.model
    mean = MeanParameters.read(Path(told.mean)) if told.mean and start else MeanParameters.of(body)
    if told.backbone == "keypoints":
        return HMR(KeypointEncoder(), WIDTH, mean, hidden=WIDTH, dropout=told.dropout)
    model = HMR(*backbone(told.backbone, told.pretrained and start), mean, dropout=told.dropout)
    if told.spin and start:
        load_spin(model, told.spin)
    return model
