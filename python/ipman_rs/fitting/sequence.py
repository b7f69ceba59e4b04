"""Fitting a recording: T frames of one person, whose shape, focal length and ground are the same in all of them.

1. Warm start. From the frame that shows most, forwards and backwards, a frame every tenth of a second is fitted by the
   first stage, from its own start and from the result of the one before, and what costs less is kept; then the frames
   between in the same way, from the nearest of these. Shape and focal length are those that the first frame found.
2. Every stage together. One Levenberg-Marquardt for the whole recording: own pose and place of every frame, one shape,
   and the smoothness, which ties each frame to the next two. Its Hessian is a band with a border (`solvers.arrow`), so
   an iteration is as long as the recording, and nothing is alternated. Presets of another solver are solved like this,
   too. It takes about 0.4 MB per frame.

The ground, where it is not known and a stage asks for it, lies level at the median over the frames of the lowest
vertex: a person who jumps now and then does not move it.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import replace
from functools import partial

import numpy as np
import torch
from torch import Tensor

import ipman_rs.torch as ipt
from ipman_rs.checks import not_negative

from ..torch.threads import one_thread
from .config import FitConfig, Stage
from .fit import CHUNK, Fit, StageReport, run_stage, with_ground_under_body, with_static_mask
from .hypotheses import with_contacts
from .objective import Objective
from .problem import Problem
from .solvers import SolverOptions, ValueAndGradient, minimise
from .solvers.arrow import Arrow, solve
from .solvers.levenberg import levenberg
from .terms.smoothness import Smoothness
from .variables import Variables, pack, unpack

SHARED = ("betas", "log_focal")
KEY = 0.1  # s: people look much the same after this time
Progress = Callable[[str, int], None]


def fit_sequence(
    problem: Problem,
    variables: Variables,
    config: FitConfig,
    *,
    smoothness: float = 0.1,
    rate: float = 1.0,
    order: int = 2,
    done: Tensor | None = None,
    progress: Progress | None = None,
) -> Fit:
    """Fit the frames, rows of `problem` in the order of time, from `variables` on by the stages of `config`.

    `smoothness` weighs the squared acceleration (m/s²)² of the body's points, see `terms.smoothness`, at `rate` frames
    a second; with `order` 1 it is their velocity. `done` (T,) bool: frames whose start is an earlier result and needs
    no warm start. `progress` hears a stage and how many frames it has behind it.
    """
    smooth = Smoothness(problem.body, problem.num_bodies, rate, order)
    smooth.band *= not_negative("smoothness", smoothness)
    reports = []
    known = problem.ground is not None
    with one_thread():
        for number, stage in enumerate(config.stages):
            if stage.find_ground and not known:
                problem = on_one_ground(problem, variables)
            problem = with_contacts(with_static_mask(problem, variables), variables)
            if number == 0:
                variables = warm_start(problem, variables, stage, config, rate, done, progress)
            together = SequenceObjective(problem, variables, stage, config, smooth)
            variables, report = together.solved(progress)
            reports.append(report)
    return Fit(problem, variables, reports)


def on_one_ground(problem: Problem, variables: Variables) -> Problem:
    """The problem with one level ground for all frames."""
    each = with_ground_under_body(problem, variables).ground
    assert each is not None
    return replace(problem, ground=ipt.Ground(each.normal, each.height.nanmedian().expand(len(each.height))))


def warm_start(
    problem: Problem,
    variables: Variables,
    stage: Stage,
    config: FitConfig,
    rate: float = 1.0,
    done: Tensor | None = None,
    progress: Progress | None = None,
) -> dict[str, Tensor]:
    """Fit every frame separately, starting from a neighbour's result; shared variables are equal in all frames."""
    frames = problem.num_bodies
    done = torch.zeros(frames, dtype=torch.bool) if done is None else done
    results = {name: value.clone() for name, value in variables.items()}
    seed = int(done.int().argmax() if done.any() else observed_weight(problem).argmax())
    stage = replace(stage, solver="levenberg")
    own = tuple(name for name in stage.free if name not in SHARED)

    def fit_frames(index: Tensor, starts: Variables, free: tuple[str, ...]) -> None:
        """From one start per frame; or from two, the second ones in the second half of the rows."""
        both = index.repeat(len(starts["pose"]) // len(index))
        fitted, report = run_stage(problem.rows(both), starts, replace(stage, free=free), config.terms)
        costs = np.nan_to_num(sum(report.terms.values()), nan=np.inf).reshape(-1, len(index))
        costs[0, (observed_weight(problem)[index] == 0).numpy()] = np.inf  # nothing speaks for the frame's own start
        winners = torch.from_numpy((len(costs) - 1 - costs[::-1].argmin(axis=0)) * len(index) + np.arange(len(index)))
        for name, value in fitted.items():
            results[name][index] = value[winners]

    if not done[seed]:
        first = torch.tensor([seed])
        fit_frames(first, {name: value[first] for name, value in variables.items()}, stage.free)
    for name in SHARED:
        results[name][:] = results[name][seed].clone()
    ready = 1
    for steps in propagation_order(seed, frames, max(1, round(KEY * rate))):
        here, near = torch.tensor([step for step in steps if not done[step[0]]], dtype=torch.long).reshape(-1, 2).T
        if len(here) and own:
            starts = {name: torch.cat([value[here], value[near]]) for name, value in results.items()}
            fit_frames(here, starts, own)
        ready += len(steps)
        if progress is not None:
            progress(f"{stage.name}, frame by frame", ready)
    return results


def propagation_order(seed: int, frames: int, stride: int) -> Iterator[list[tuple[int, int]]]:
    """The order of the warm start: lists of frames that are fitted together, each with the frame it starts from.

    First every `stride`-th frame, one after the other away from the seed, then all the others at once."""
    for direction in (1, -1):
        for frame in range(seed + direction * stride, frames if direction > 0 else -1, direction * stride):
            yield [(frame, frame - direction * stride)]
    rest = []
    for frame in range(frames):
        if (frame - seed) % stride:
            near = seed + round((frame - seed) / stride) * stride
            near = near if 0 <= near < frames else near - stride if near > seed else near + stride
            rest.append((frame, near))
    if rest:
        yield rest


def observed_weight(problem: Problem) -> Tensor:
    """The summed confidence (T,) of the points observed in each frame."""
    total = torch.zeros(problem.num_bodies, dtype=torch.float64)
    for confidence in (problem.confidence, problem.confidence_3d):
        if confidence is not None:
            total = total + confidence.sum(dim=1)
    return total


class SequenceObjective:
    """The objective of a stage over a whole recording. A point is every frame's own numbers, then the shared ones.

    Frames that are not finite where the stage begins are left out: they follow their neighbours.
    """

    def __init__(self, problem: Problem, variables: Variables, stage: Stage, config: FitConfig, smooth: Smoothness):
        self.problem, self.variables, self.stage, self.smooth = problem, variables, stage, smooth
        own = [name for name in stage.free if name not in SHARED]
        self.free = (*own, *(name for name in stage.free if name in SHARED))
        self.frames, self.size = problem.num_bodies, pack(variables, own).shape[1] if own else 0
        self.objective = Objective(problem, variables, self.free, stage.weights, stage.term_options(config.terms))
        chunks = [range(first, min(first + CHUNK, self.frames)) for first in range(0, self.frames, CHUNK)]
        self.parts = [(chunk, self.objective.rows(chunk)) for chunk in chunks]
        rows = pack(variables, self.free).numpy()
        self.sound = np.array([evaluation.finite for evaluation in self.evaluations(rows)])
        self.start = np.concatenate([rows[:, : self.size].ravel(), rows[0, self.size :]])

    def solved(self, progress: Progress | None = None) -> tuple[dict[str, Tensor], StageReport]:
        """The variables of all frames, and how it went: the same for all but those that were left out."""
        options = self.stage.options
        options = SolverOptions(options.iterations, options.gradient, options.decrease * self.frames)
        on_ended = None if progress is None else (lambda ended: progress(self.stage.name, ended * self.frames))
        solver = partial(levenberg, solve=solve)
        (outcome,) = minimise(
            solver, self.start[None], lambda _, points: [self.evaluation(points[0])], options, on_ended
        )
        rows = torch.from_numpy(self.rows(outcome.point))
        with torch.no_grad():
            costs = self.objective.costs(self.objective.candidate(rows))
        reasons = [outcome.reason if sound else "not finite" for sound in self.sound]
        iterations = [outcome.iterations] * self.frames
        ended = {name: cost.numpy() for name, cost in costs.items()}
        variables = unpack(rows, self.free, self.variables)
        return variables, StageReport(self.stage.name, reasons, iterations, ended, variables)

    def rows(self, point: np.ndarray) -> np.ndarray:
        """(T, P), the shared numbers in every row."""
        own = point[: self.frames * self.size].reshape(self.frames, self.size)
        return np.concatenate([own, np.tile(point[self.frames * self.size :], (self.frames, 1))], axis=1)

    def evaluations(self, rows: np.ndarray) -> list[ValueAndGradient]:
        """Each frame by itself."""
        return [evaluation for chunk, part in self.parts for evaluation in part.models(rows[chunk.start : chunk.stop])]

    def evaluation(self, point: np.ndarray) -> ValueAndGradient:
        """All frames, with the smoothness between them."""
        rows, own = self.rows(point), slice(None, self.size)
        evaluations = [
            evaluation for evaluation, sound in zip(self.evaluations(rows), self.sound, strict=True) if sound
        ]
        gradient, hessian = np.zeros(rows.shape), np.zeros((*rows.shape, rows.shape[1]))
        if evaluations:
            gradient[self.sound] = [evaluation.gradient for evaluation in evaluations]
            hessian[self.sound] = [evaluation.hessian for evaluation in evaluations]
        value = sum(evaluation.value for evaluation in evaluations)
        blocks = np.zeros((len(self.smooth.band), self.frames, self.size, self.size))
        if self.smooth.band.any():
            value += self._add_smoothness(rows, gradient, hessian, blocks)
        blocks[0] += hessian[:, own, own]
        arrow = Arrow(blocks, hessian[:, own, self.size :], hessian[:, self.size :, self.size :].sum(axis=0))
        whole = np.concatenate([gradient[:, own].ravel(), gradient[:, self.size :].sum(axis=0)])
        return ValueAndGradient(value, whole, arrow)

    def _add_smoothness(self, rows: np.ndarray, gradient: np.ndarray, hessian: np.ndarray, blocks: np.ndarray) -> float:
        """Its value; its gradient 2 J Q x, and 2 J Q Jᵀ: own numbers into `blocks`, the rest into `hessian`."""
        variables = unpack(torch.from_numpy(rows), self.free, self.variables)
        x, slopes = self.smooth.linearised(self.problem, variables, self.free)
        gradient += 2 * _times(slopes, self.smooth.pull(x)[..., None])[..., 0]
        own, shared = slopes[:, : self.size], slopes[:, self.size :]
        hessian[:, :, self.size :] += 2 * _times(slopes, self.smooth.pull(shared).swapaxes(1, 2))
        for k, weight in enumerate(self.smooth.band):
            last = self.frames - k
            if last > 0:
                blocks[k, :last] = 2 * weight[:last, None, None] * _times(own[k:], own[:last].swapaxes(1, 2))
        return self.smooth.cost(x)


def _times(left: np.ndarray, right: np.ndarray) -> np.ndarray:
    """Matrix products frame by frame, on torch's one thread."""
    return torch.bmm(torch.from_numpy(left), torch.from_numpy(right)).numpy()
