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
    from ..trainer.config import TrainingConfig


def build_model(settings: TrainingConfig, body: BodyModel, start: bool = True) -> HMR:
    """start: with the weights and mean parameters that it is to start from; without, those of a checkpoint follow.

    ValueError for files that do not fit, and unknown backbones.
    """
    model_settings = settings.model
    model = _made(settings, body, start)
    if model_settings.start and start:
        _go_on_from(model, model_settings.start)
    return model


def _go_on_from(model: HMR, path: str) -> None:
    settings, weights = read_trained(path)
    try:
        model.load_state_dict(weights)
    except RuntimeError:
        stored = f"{settings['model']['backbone']} for {settings['body']}"
        raise ValueError(f"{path}: does not fit this model: it has the backbone {stored}") from None


def _made(settings: TrainingConfig, body: BodyModel, start: bool) -> HMR:
    model_settings = settings.model
    mean = MeanParameters.read(Path(model_settings.mean)) if model_settings.mean and start else MeanParameters.of(body)
    if model_settings.backbone == "keypoints":
        return HMR(KeypointEncoder(), WIDTH, mean, hidden=WIDTH, dropout=model_settings.dropout)
    model = HMR(
        *backbone(model_settings.backbone, model_settings.pretrained and start), mean, dropout=model_settings.dropout
    )
    if model_settings.spin and start:
        load_spin(model, model_settings.spin)
    return model
