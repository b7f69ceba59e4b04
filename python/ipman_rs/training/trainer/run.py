"""A training run in a folder: started, or continued from its last checkpoint."""

from __future__ import annotations

import dataclasses
import pickle
import sys
from pathlib import Path

import lightning
from lightning.pytorch.callbacks import ModelCheckpoint
from lightning.pytorch.loggers import TensorBoardLogger

from ipman_rs.files import write_whole

from .checkpoints import LastCheckpoint, WholeFiles
from .config import TrainingConfig, as_dict, load
from .curve import Curve
from .module import Training

LAST, BEST, SETTINGS = "last.ckpt", "best", "config.yaml"
FREE = ("steps", "devices", "nodes", "accelerator", "workers", "validate", "save", "log")  # may change when going on


def train(settings: TrainingConfig, folder: Path) -> Path:
    """Train as configured; the path of the last checkpoint.

    A folder with a checkpoint of the same configuration is gone on with: the same losses follow as if nothing had
    interrupted it. Writes config.yaml, curve.csv, validation.csv, last.ckpt, and best.ckpt by the first validation
    set's PVE; and TensorBoard's files where tensorboard is installed.

    ValueError: the data cannot be opened, or the folder holds a run of another configuration or a damaged checkpoint.
    """
    last = folder / LAST
    _keep(settings, folder)
    module = Training(settings)
    trainer = lightning.Trainer(
        accelerator=settings.accelerator,
        devices=settings.devices,
        num_nodes=settings.nodes,
        strategy="ddp" if settings.devices * settings.nodes > 1 else "auto",
        precision=settings.precision,  # type: ignore[arg-type]
        max_steps=settings.steps,
        max_epochs=-1,
        val_check_interval=settings.validate if settings.validation and settings.validate else 1.0,
        limit_val_batches=1.0 if settings.validation and settings.validate else 0,
        check_val_every_n_epoch=None if settings.validation and settings.validate else 1,
        num_sanity_val_steps=0,
        log_every_n_steps=settings.log,
        logger=_logger(folder),
        callbacks=_callbacks(settings, folder),
        plugins=[WholeFiles()],
        use_distributed_sampler=False,  # ours says which process takes what
        default_root_dir=folder,
        enable_model_summary=False,
        enable_progress_bar=sys.stderr.isatty(),
    )
    try:
        trainer.fit(module, ckpt_path=str(last) if last.exists() else None, weights_only=True)
    except (RuntimeError, KeyError, EOFError, pickle.UnpicklingError) as error:
        if last.exists() and trainer.global_step == 0:
            raise ValueError(f"{last}: not a checkpoint of this model: {str(error).splitlines()[0]}") from error
        raise
    return last


def _keep(settings: TrainingConfig, folder: Path) -> None:
    """Write down the configuration; ValueError if the folder has a run of another one."""
    import yaml

    folder.mkdir(parents=True, exist_ok=True)
    path = folder / SETTINGS
    if path.exists():
        before = load(path)
        same = {name: getattr(before, name) for name in FREE if name != "steps" or before.schedule == "constant"}
        changed = dataclasses.replace(settings, **same)
        for entry in dataclasses.fields(TrainingConfig):
            if getattr(changed, entry.name) != getattr(before, entry.name):
                raise ValueError(
                    f"{folder}: has a run with another {entry.name} ({path}); choose another folder, or remove it"
                )
    write_whole(path, yaml.safe_dump(as_dict(settings), sort_keys=False))


def _callbacks(settings: TrainingConfig, folder: Path) -> list[lightning.Callback]:
    callbacks: list[lightning.Callback] = [Curve(folder)]
    validated = settings.validate if settings.validation else 0
    if validated:
        callbacks.append(ModelCheckpoint(folder, BEST, monitor="PVE", mode="min", enable_version_counter=False))
    return [*callbacks, LastCheckpoint(folder / LAST, settings.save, validated)]


def _logger(folder: Path) -> TensorBoardLogger | bool:
    try:
        return TensorBoardLogger(folder, name="tensorboard", version="")
    except ModuleNotFoundError:
        return False
