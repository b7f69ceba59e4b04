"""A whole evaluation: predictions measured piece by piece, added up, and written as tables."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from ipman_rs.files import path_list
from ipman_rs.files.names import Paths
from ipman_rs.progress import Progress, silent

from . import report
from .job import Job, Shard, Source, method_names
from .paper import TABLES, Table
from .summary import difference, summarise

PathLike = str | os.PathLike[str]
WHOLE = Shard()


@dataclass(frozen=True)
class Evaluation:
    """One or several methods on one data set, each in pieces below `folder`; the later ones are compared with the
    first. `table`: of the paper, whose metrics are reported."""

    jobs: Sequence[Job]
    folder: Path
    table: Table | None = None

    def begin(self) -> list[str]:
        """Makes the folders; what is odd about the predictions, and which pieces are damaged and measured again.

        ValueError where a folder holds another evaluation, or predictions do not fit the data set.
        """
        warnings: list[str] = []
        for job in self.jobs:
            job.begin()
            warnings += [
                f"{job.file(number)}: is not whole, or of another evaluation; it is measured again"
                for number in job.damaged()
            ]
            warnings += [f"{job.predictions}: {flag}" for flag in job.flags]
        return warnings

    def measure(self, shard: Shard = WHOLE, ray: bool = False, progress: Progress = silent) -> int:
        """Does the pieces of a shard that are not there yet, on Ray those of all shards; how many frames they have."""
        todo = sum(job.frames(number) for job in self.jobs for number in shard.of(job.pieces) if not job.done(number))
        with _counted(progress, "measuring", todo) as count:
            if ray:
                from . import on_ray

                on_ray.run(list(self.jobs), count)
            else:
                for job in self.jobs:
                    job.run(shard, count)
        return todo

    @property
    def pieces(self) -> int:
        """Of all methods."""
        return sum(job.pieces for job in self.jobs)

    @property
    def missing(self) -> int:
        """How many pieces are not there yet."""
        return sum(len(job.missing()) for job in self.jobs)

    def report(self, progress: Progress = silent) -> report.Report:
        """All pieces added up. ValueError where one is missing."""
        jobs, source = self.jobs, self.jobs[0].source
        frames = sum(len(job.data) for job in jobs)
        with _counted(progress, "adding up", 2 * frames - len(jobs[0].data)) as count:
            summaries = [summarise(job, count) for job in jobs]
            differences = [difference(job, jobs[0], count) for job in jobs[1:]]
        title = self.table.title if self.table else f"{' and '.join(job.name for job in jobs)} on {source.name}"
        parts = [source.name, *([source.split] if source.split else []), *(f"{k}={v}" for k, v in source.options)]
        where = f"Data: {', '.join(parts)}, {len(jobs[0].data):,} frames ({source.path})."
        definitions = {job.name: job.definition for job in jobs}
        flags = {job.name: job.flags for job in jobs}
        return report.Report(title, where, summaries, differences, self.table, definitions, flags)

    def write(self, summary: report.Report, progress: Progress = silent) -> list[Path]:
        """The files of a report, the page first. frames.parquet is left out where pyarrow is missing."""
        with _counted(progress, "writing", sum(len(job.data) for job in self.jobs)) as count:
            return report.write(summary, self.folder, list(self.jobs), count)


def evaluation(
    predictions: Paths,
    output: PathLike,
    *,
    path: PathLike,
    data: str | None = None,
    table: str | None = None,
    split: str | None = None,
    options: Mapping[str, str | int | float] | None = None,
    models: PathLike | None = None,
    regressors: Sequence[PathLike] = (),
    preset: str = "paper-r",
    partial: bool = False,
    unit: float = 1.0,
    degrees: bool = False,
    force: bool = False,
) -> Evaluation:
    """The evaluation of files of predictions ("truth": the data set's own bodies), nothing measured yet.

    Args:
        output: folder of the pieces and the report.
        path: file or folder of the data set `data`, a name of `ipman_rs.data.DATASETS` or "own".
        table: a name of `TABLES`, which has a data set, a split and options of its own where none are given.
        options: of the data set's reader.
        models: folder of body models. regressors: files of joint regressors.
        partial: frames without prediction are left out instead of being an error.
        unit: metres in one of the predictions' lengths. degrees: of their rotations. force: what cannot be people is
            measured, too.

    Raises:
        ValueError: neither data nor table, or an unknown table.
    """
    if table is not None and table not in TABLES:
        raise ValueError(f"table: expected one of {', '.join(TABLES)}, got {table!r}")
    paper = None if table is None else TABLES[table]
    name = data or (paper.data if paper else None)
    if name is None:
        raise ValueError("data: expected the name of a data set, or that of a table of the paper")
    own = paper if paper is not None and name == paper.data else None
    chosen = {**(own.options if own else {}), **(options or {})}
    source = Source(name, str(path), split or (own.split if own else None), tuple(chosen.items()))
    shared: dict[str, Any] = {
        "models": None if models is None else str(models), "regressors": tuple(map(str, regressors)),
        "preset": preset, "partial": partial, "unit": unit, "degrees": degrees, "force": force,
    }  # fmt: skip
    files = path_list(predictions)
    if not files:
        raise ValueError("predictions: expected one file or more, got none")
    jobs = [
        Job(name, str(file), source, str(output), **shared)
        for name, file in zip(method_names(files), files, strict=True)
    ]
    return Evaluation(jobs, Path(output), paper)


def evaluate(predictions: Paths, output: PathLike, *, progress: Progress = silent, **given: Any) -> report.Report:
    """Measure predictions against a data set and write the report; what `ipman evaluate` does.

    `given`: as of `evaluation`. Interrupted, the same call continues.

    Raises:
        ValueError: a file cannot be read, does not fit the data set, or cannot be of people.
        OSError: the folder cannot be written.
    """
    whole = evaluation(predictions, output, **given)
    whole.begin()
    whole.measure(progress=progress)
    summary = whole.report(progress)
    whole.write(summary, progress)
    return summary


@contextmanager
def _counted(progress: Progress, title: str, total: int) -> Iterator[Callable[[int], None]]:
    """`count(n)`: n more are done."""
    done = 0
    with progress(title, total) as step:

        def count(more: int) -> None:
            nonlocal done
            done += more
            step.to(done)

        yield count
