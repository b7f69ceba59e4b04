"""The whole ablation of training: data made, every variant trained, tables written."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from ipman_rs.progress import Progress, silent

from . import report
from .run import TILTS, TrainingBenchmark


def benchmark(
    run: TrainingBenchmark, tilts: Sequence[float] = (), workers: int = 1, progress: Progress = silent
) -> Path:
    """Train the regressors of a benchmark; the page of its folder. Interrupted, it continues.

    tilts: degrees by which labels lean; those of the task where there is none. workers: processes.

    Raises:
        ValueError: the images cannot be read, or the folder holds another benchmark.
        OSError: the folder cannot be written.
        BrokenProcessPool: a process ended too early.
    """
    with progress(f"preparing {run.task.name}", None) as step:
        run.task.make(step.of)
    with progress("training", None) as step:
        results = run.run(tuple(dict.fromkeys(tilts)) or TILTS[run.task.name], workers, step.of)
    return report.write(results, run)
