"""The whole ablation of fitting: people drawn, every variant fitted, tables written."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from ipman_rs.progress import Progress, silent

from . import report
from .run import FittingBenchmark, blocks


def benchmark(run: FittingBenchmark, only: Sequence[str] = (), progress: Progress = silent) -> Path:
    """Fit the people of a benchmark with and without physics; the page of its folder. Interrupted, it continues.

    only: the starts of names of blocks; all blocks where there is none.

    Raises:
        ValueError: no block is called so.
        OSError: the folder cannot be written.
    """
    chosen = [block for block in blocks() if not only or block.name.startswith(tuple(only))]
    if not chosen:
        raise ValueError(f"expected the start of one of: {'; '.join(block.name for block in blocks())}")
    for kind in dict.fromkeys(block.kind for block in chosen):
        with progress(f"drawing {kind} people", run.count(kind)) as step:
            run.truth(kind, step.to)
    with progress("fitting", sum(len(block.rows) for block in chosen)) as step:
        results = [(block, *run.run(block, step.one)) for block in chosen]
    return report.write(results, run)
