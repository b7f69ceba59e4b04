"""The losses of every step and the metrics of every validation, as CSV files that survive a kill."""

from __future__ import annotations

import csv
import errno
import io
import os
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import lightning

from ipman_rs.files import write_whole


class Curve(lightning.Callback):
    """`curve.csv`: a line a step; `validation.csv`: a line a validation. A run that goes on from a checkpoint first
    drops the lines that it will write again."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder

    def on_train_start(self, trainer: lightning.Trainer, pl_module: lightning.LightningModule) -> None:
        if trainer.is_global_zero:
            for name, last in (("curve.csv", trainer.global_step - 1), ("validation.csv", trainer.global_step)):
                drop_after(self.folder / name, last)

    def on_train_batch_end(
        self, trainer: lightning.Trainer, pl_module: lightning.LightningModule, outputs: Any, batch: Any, batch_idx: int
    ) -> None:
        if trainer.is_global_zero:
            numbers = {"loss": outputs["loss"], **outputs["terms"]}
            self._write("curve.csv", trainer.global_step - 1, {key: float(value) for key, value in numbers.items()})

    def on_validation_end(self, trainer: lightning.Trainer, pl_module: lightning.LightningModule) -> None:
        if trainer.is_global_zero:
            metrics = {key: float(value) for key, value in trainer.callback_metrics.items() if "/" in key}
            self._write("validation.csv", trainer.global_step, metrics)

    def _write(self, name: str, step: int, numbers: Mapping[str, float]) -> None:
        path, text = self.folder / name, io.StringIO()
        lines = csv.writer(text, lineterminator="\n")
        if not path.exists():
            lines.writerow(["step", *numbers])
        lines.writerow([step, *(repr(value) for value in numbers.values())])
        content = text.getvalue().encode()
        with path.open("ab", buffering=0) as file:
            end = file.tell()
            try:
                if file.write(content) != len(content):
                    raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
            except OSError:  # whole lines stay
                file.truncate(end)
                raise


def drop_after(path: Path, last: int) -> None:
    """Leaves the lines of steps up to `last`, whole ones only."""
    if not path.exists():
        return
    head, *lines = path.read_text().splitlines(keepends=True) or [""]
    if not head.endswith("\n"):  # a kill came before the first whole line
        path.unlink()
        return
    # A kill may have cut the last line short.
    remaining = [line for line in lines if line.endswith("\n") and int(line.partition(",")[0]) <= last]
    write_whole(path, "".join([head, *remaining]))
