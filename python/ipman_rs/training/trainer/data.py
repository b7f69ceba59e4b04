"""The data sets of a configuration as loaders."""

from __future__ import annotations

import os
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from torch.utils.data import DataLoader, Dataset

from ipman_rs.body import BodyModel
from ipman_rs.body.joint_regressors import JointRegressor, read

from ..batch import Batch
from ..model.keypoint_encoder import KEYPOINTS
from ..posed_estimate import REGRESSED
from ..sources import BadSample, Images, Mixture, People, Share, Source
from ..sources.mixture import Steps
from . import config

PEOPLE_SEED, VALIDATION_SEED = 41_000, 42_000


def keypoint_names(regressed: bool = False) -> tuple[str, ...]:
    """The keypoints that every data set is asked for; with those that a regressor makes."""
    return (*KEYPOINTS, *REGRESSED) if regressed else KEYPOINTS


def regressor(settings: config.TrainingConfig) -> JointRegressor | None:
    """What `model.regressor` names. ValueError, naming the file, if it cannot be read."""
    path = settings.model.regressor
    return read(os.path.expanduser(path)) if path else None


def source(
    data_set: config.DataSettings, settings: config.TrainingConfig, body: BodyModel, seed: int = PEOPLE_SEED
) -> Source:
    """One data set. ValueError, naming it, if it cannot be opened or does not fit the model."""
    of_keypoints = settings.model.backbone == "keypoints"
    if data_set.name == "people":
        if not of_keypoints:
            raise ValueError("data: 'people' are keypoints; they need model.backbone: keypoints")
        if not data_set.path.isdigit() or int(data_set.path) < 1:
            raise ValueError(f"data: people: path: expected their number, got {data_set.path!r}")
        return People(int(data_set.path), seed, **data_set.options)
    if of_keypoints:
        raise ValueError(f"data: {data_set.name}: model.backbone 'keypoints' is for 'people' alone")
    import ipman_rs.data

    try:
        data = ipman_rs.data.open(data_set.name, Path(os.path.expanduser(data_set.path)), **data_set.options)
    except (OSError, TypeError, ValueError) as error:
        raise ValueError(f"data: {data_set.name}: {error}") from None
    folder = Path(os.path.expanduser(data_set.images))
    regressed = bool(settings.model.regressor)
    names = keypoint_names(regressed)
    return Images(data, body, names, settings.model.size, settings.augment, folder, regressed)


def training_loader(
    settings: config.TrainingConfig, body: BodyModel, start: int, rank: int, processes: int
) -> DataLoader:
    """Batches of one process from step `start` on."""
    shares = [Share(data_set.name, source(data_set, settings, body), data_set.share) for data_set in settings.data]
    steps = Steps(start, settings.steps, settings.batch, rank, processes)
    return ResumableLoader(
        Mixture(shares, settings.seed), batch_sampler=steps, collate_fn=Batch.of, num_workers=settings.workers
    )


class ResumableLoader(DataLoader):
    """A loader that Lightning may resume in the middle; `Steps` gets the position when the loader is made."""

    def state_dict(self) -> dict[str, Any]:
        return {}

    def load_state_dict(self, state: dict[str, Any]) -> None:
        pass


def validation_loaders(settings: config.TrainingConfig, body: BodyModel, rank: int, processes: int) -> list[DataLoader]:
    """A loader for each set: this process' part of it, as it is."""
    loaders = []
    for data_set in settings.validation:
        rows = ValidationSamples(source(data_set, settings, body, VALIDATION_SEED), rank, processes)
        loaders.append(DataLoader(rows, settings.batch, collate_fn=_good, num_workers=settings.workers))
    return loaders


class ValidationSamples(Dataset):
    """Every `processes`-th sample of a source, not augmented; None for a bad one."""

    def __init__(self, origin: Source, rank: int, processes: int) -> None:
        self.origin, self.rows = origin, range(rank, len(origin), processes)

    def __len__(self) -> int:
        return len(self.rows)

    def __getitem__(self, index: int):
        try:
            return self.origin.sample(self.rows[index], None)
        except BadSample:
            return None


def _good(samples: Sequence) -> Batch | None:
    usable = [sample for sample in samples if sample is not None]
    return Batch.of(usable) if usable else None
