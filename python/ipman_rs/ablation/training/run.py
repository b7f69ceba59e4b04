"""Training of all rows on all labels, in several processes. Finished jobs are saved in a folder and reused."""

from __future__ import annotations

import multiprocessing
from collections.abc import Callable, Iterable, Sequence
from concurrent.futures import FIRST_COMPLETED, Future, ProcessPoolExecutor, wait
from dataclasses import asdict, dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import Any, BinaryIO

import torch

from ipman_rs.files import atomic_write
from ipman_rs.presets import get
from ipman_rs.processes import end_with_parent
from ipman_rs.renamed import old_names
from ipman_rs.torch.threads import one_thread

from ...training.batch import Batch
from ...training.losses import Loss
from ...training.metrics import PoseMetrics, pose_metrics
from ...training.tilted_labels import TiltAxis, tilt_labels
from ...training.train_loop import TrainingPlan, estimate_all, run_plan
from .shuffled_camera import shuffled_camera
from .task import Plan, Task, key_of
from .variants import TrainingVariant, ablation_of

__getattr__ = old_names(__name__, {"Benchmark": "TrainingBenchmark"})

LEANS, DEALS = 35_000, 36_000  # seeds of the labels' leans, and of the shuffled cameras
TILTS = {"keypoints": (0.0, 4.0, 8.0, 12.0), "images": (0.0, 8.0)}


@dataclass(frozen=True)
class TrainingVariantResult:
    """A row, and its figures for each seed."""

    row: TrainingVariant
    figures: list[PoseMetrics]


@dataclass(frozen=True)
class Job:
    """Training of a row; of the model from which all rows start (row: None); or of the backbone (tilt: None, too)."""

    seed: int
    tilt: float | None = None
    row: TrainingVariant | None = None


@dataclass(frozen=True)
class TrainingBenchmark:
    """seeds: of weights and batches. part: of the settings' steps, for trials. lean: as in `tilt_labels`."""

    folder: Path
    task: Task
    seeds: int = 3
    part: float = 1.0
    lean: TiltAxis = "camera"

    def run(
        self, tilts: Sequence[float], workers: int = 1, progress: Callable[[int, int], None] | None = None
    ) -> dict[float, list[TrainingVariantResult]]:
        """All rows with labels that lean by `tilts` degrees. progress: how many trainings of how many are done."""
        self.folder.mkdir(parents=True, exist_ok=True)
        self.task.make()
        first = [Job(seed) for seed in range(self.seeds)] if self.plan.first else []
        base = [Job(seed, tilt) for tilt in tilts for seed in range(self.seeds)]
        fine = [replace(job, row=row) for job in base for row in self.rows]
        jobs = [*first, *base, *fine]
        for done, _ in enumerate(self._all(jobs, workers), 1):
            if progress is not None:
                progress(done, len(jobs))
        return {tilt: [self._result(tilt, row) for row in self.rows] for tilt in tilts}

    @cached_property
    def plan(self) -> Plan:
        plan = ablation_of(self.task.name).plan
        return Plan(self._shortened(plan.base), self._shortened(plan.fine), plan.first and self._shortened(plan.first))

    @property
    def rows(self) -> tuple[TrainingVariant, ...]:
        return ablation_of(self.task.name).rows

    def _shortened(self, plan: TrainingPlan) -> TrainingPlan:
        return replace(plan, steps=max(1, round(plan.steps * self.part)))

    def do(self, job: Job) -> None:
        """One training; the file of what came out."""
        place = self._place(job)
        if place.exists():
            return
        with one_thread(), atomic_write(place) as file:
            if job.tilt is None:
                assert self.plan.first
                self.task.fit_backbone(job.seed, self.plan.first, file)
            else:
                self._train(job, job.tilt, file)

    def _all(self, jobs: Sequence[Job], workers: int) -> Iterable[None]:
        waiting = [job for job in jobs if not self._place(job).exists()]
        yield from (None for _ in range(len(jobs) - len(waiting)))
        if workers == 1:
            yield from map(self.do, waiting)
            return
        context = multiprocessing.get_context("spawn")
        with ProcessPoolExecutor(workers, context, _in_process, (self,)) as pool:
            try:
                running: set[Future[None]] = set()
                while waiting or running:
                    ready = [job for job in waiting if self._can_begin(job)]
                    waiting = [job for job in waiting if job not in ready]
                    finished, running = wait(running | {pool.submit(_do, job) for job in ready}, None, FIRST_COMPLETED)
                    yield from (future.result() for future in finished)
            except BaseException:
                pool.shutdown(wait=False, cancel_futures=True)
                raise

    def _can_begin(self, job: Job) -> bool:
        """Whether the file that it starts from exists."""
        if job.row is not None:
            return self._place(replace(job, row=None)).exists()
        seen = self._seen(job.seed)
        return job.tilt is None or seen is None or seen.exists()

    def _train(self, job: Job, tilt: float, file: BinaryIO) -> None:
        """Writes weights, or the metrics of a row, into the file."""
        model, data, posing = self.task.lifting_network(job.seed), self._data(job.seed, tilt), self.task.posing()
        if job.row is not None:
            model.load_state_dict(torch.load(self._place(replace(job, row=None)), weights_only=True))
        physics = None if job.row is None else job.row.physics(posing.body.template)
        loss = Loss(posing, physics)
        if job.row is not None and job.row.shuffled:
            data = shuffled_camera(data, DEALS)
        plan, seed = (self.plan.base, job.seed) if job.row is None else (self.plan.fine, 1000 + job.seed)
        run_plan(model, lambda batch: loss(model(batch.inputs), batch)[0], data, self.task.noisy, plan, seed)
        if job.row is None:
            torch.save(model.state_dict(), file)
        else:
            truth = self._truth(job.seed)
            pose_metrics(estimate_all(model, truth.inputs), truth, posing).save(file)

    def _data(self, seed: int, tilt: float) -> Batch:
        """The last one is kept."""
        seen = self._seen(seed)
        if (seen, tilt) not in self._kept:
            self._kept.clear()
            self._kept[seen, tilt] = tilt_labels(self.task.training(seen), tilt, LEANS, self.lean)
        return self._kept[seen, tilt]

    @cached_property
    def _kept(self) -> dict[tuple[Path | None, float], Batch]:
        return {}

    def _truth(self, seed: int) -> Batch:
        """Kept for each seed."""
        seen = self._seen(seed)
        if seen not in self._truths:
            self._truths[seen] = self.task.truth(seen)
        return self._truths[seen]

    @cached_property
    def _truths(self) -> dict[Path | None, Batch]:
        return {}

    def _seen(self, seed: int) -> Path | None:
        """The file of what the first stage sees."""
        return self._place(Job(seed)) if self.plan.first else None

    def _result(self, tilt: float, row: TrainingVariant) -> TrainingVariantResult:
        return TrainingVariantResult(
            row, [PoseMetrics.load(self._place(Job(seed, tilt, row))) for seed in range(self.seeds)]
        )

    def _place(self, job: Job) -> Path:
        """The file of a result: named by all that decides it."""
        settings: list[Any] = [self.task.trained_on(), job.seed, self.plan.first and asdict(self.plan.first)]
        if job.tilt is not None:
            settings += [job.tilt, job.tilt and self.lean, asdict(self.plan.base)]
        if job.row is not None:
            row = job.row
            settings += [
                asdict(self.plan.fine),
                row.preset and asdict(get(row.preset)),
                dict(row.weights),
                row.shuffled,
            ]
            settings.append(self.task.tested_on())
        return self.folder / (f"base-{key_of(settings)}.pt" if job.row is None else f"figures-{key_of(settings)}.npz")


# The benchmark of a working process, which keeps the data of its last tilt.
_BENCHMARK: list[TrainingBenchmark] = []


def _in_process(benchmark: TrainingBenchmark) -> None:
    end_with_parent()
    _BENCHMARK[:] = [benchmark]


def _do(job: Job) -> None:
    _BENCHMARK[0].do(job)
