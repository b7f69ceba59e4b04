"""The shards of an evaluation as tasks of Ray (the extra `ray`), on this machine or a cluster.

The tasks write their pieces into the evaluation's folder, so on a cluster it must be on a disk that all machines share,
as must the predictions, the data and the models. The results have the same bits, because they come from the pieces.
"""

from __future__ import annotations

import os
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

from .job import TRUTH, Job, Shard, is_file

STORE = 80_000_000  # bytes, about the least that Ray takes


def run(jobs: list[Job], progress: Callable[[int], None], address: str | None = None) -> None:
    """Computes the missing pieces. `progress(frames)` is called with the number of frames that were added.

    Raises:
        ValueError: ray is not installed, or a task failed; the pieces of other tasks are kept.
    """
    try:
        import ray  # pyright: ignore[reportMissingImports]
    except ImportError as error:
        raise ValueError("`ray` needs ray: pip install 'ipman_rs[ray]'") from error
    begun_here = not ray.is_initialized()
    if begun_here:
        quiet = {"include_dashboard": False, "log_to_driver": False, "configure_logging": False}
        # Tasks send plain values only, so a small store will do; the store of a cluster is not changed.
        store = {} if address or os.environ.get("RAY_ADDRESS") else {"object_store_memory": STORE}
        ray.init(address=address, **quiet, **store)
    try:
        _run(ray, jobs, progress)
    finally:
        if begun_here:
            ray.shutdown()


def _run(ray: Any, jobs: list[Job], progress: Callable[[int], None]) -> None:
    tasks = ray.remote(num_cpus=1, max_retries=2)(_shard)
    workers = max(1, int(ray.cluster_resources().get("CPU", 1)))
    waiting = []
    for job in map(_portable, jobs):
        # Several tasks per worker, so that workers end at about the same time although pieces differ.
        count = max(1, min(4 * workers, job.pieces))
        waiting += [tasks.remote(job, Shard(index + 1, count)) for index in range(count)]
    before = _finished_frames(jobs)
    while waiting:
        done, _ = ray.wait(list(waiting), num_returns=1, timeout=1.0)
        for each in done:
            waiting.remove(each)
            try:
                ray.get(each)
            except ray.exceptions.RayTaskError as error:
                raise ValueError(str(error.cause)) from None
        now = _finished_frames(jobs)
        progress(now - before)
        before = now


def _portable(job: Job) -> Job:
    """The same job for another process: nothing opened, and absolute paths."""

    def whole(path: str | None) -> str | None:
        return None if path is None else str(Path(path).resolve())

    options = job.source.options
    return replace(
        job,
        predictions=job.predictions if job.predictions == TRUTH else str(whole(job.predictions)),
        source=replace(
            job.source,
            path=str(whole(job.source.path)),
            options=tuple((name, str(whole(value)) if is_file(value) else value) for name, value in options),
        ),
        folder=str(whole(job.folder)),
        models=whole(job.models),
        regressors=tuple(str(whole(path)) for path in job.regressors),
    )


def _finished_frames(jobs: list[Job]) -> int:
    """The number of frames whose piece exists, whichever task wrote it."""
    return sum(job.frames(number) for job in jobs for number in range(job.pieces) if job.file(number).exists())


def _shard(job: Job, shard: Shard) -> None:
    import ipman_rs

    ipman_rs.set_num_threads(1)  # each task has one core
    job.run(shard)
