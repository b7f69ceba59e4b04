"""Fitting: the stages of a preset one after the other, each by its solver, for a batch of bodies."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
import torch

import ipman_rs.torch as ipt
from ipman_rs.torch.threads import one_thread

from . import hypotheses, static_gate
from .candidate import Candidate
from .config import FitConfig, Stage
from .hypotheses import Hypotheses, Hypothesis
from .objective import Objective
from .problem import Problem
from .solvers import SOLVERS, Outcome, ValueAndGradient, minimise
from .solvers.outcome import CONVERGED
from .variables import Variables, pack, unpack

CHUNK = 64  # bodies side by side: beyond, nothing gets faster and the Jacobian of the landmarks gets large


@dataclass(frozen=True)
class StageReport:
    """How a stage went, one entry per body: reason (`solvers.Outcome`), iterations, and the terms' weighted costs.

    `variables` are those that it ended with. `trace` has the costs of each body's successive best points, start and end
    included, if they were asked for.
    """

    name: str
    reasons: list[str]
    iterations: list[int]
    terms: dict[str, np.ndarray]  # (B,) each
    variables: Variables
    trace: list[dict[str, np.ndarray]] | None = None  # B times (n,) each

    def take(self, rows: np.ndarray) -> StageReport:
        """The report of some bodies; an index may come more than once."""
        index = torch.from_numpy(rows)
        return StageReport(
            self.name,
            [self.reasons[row] for row in rows],
            [self.iterations[row] for row in rows],
            {name: cost[rows] for name, cost in self.terms.items()},
            {name: value[index] for name, value in self.variables.items()},
            None if self.trace is None else [self.trace[row] for row in rows],
        )


@dataclass(frozen=True)
class Fit:
    """Fitted bodies: their variables (one row per body) and how each stage went. `weighed`: where the preset weighs
    hypotheses, those of each body, the cheapest first, which is this one; `runner_up`: the fit of the second ones.
    """

    problem: Problem
    variables: Variables
    stages: list[StageReport] = field(default_factory=list)
    weighed: list[list[Hypothesis]] | None = None
    runner_up: Fit | None = None

    @property
    def converged(self) -> np.ndarray:
        """(B,) bool: whether every stage converged."""
        reasons = np.array([stage.reasons for stage in self.stages])
        return np.asarray(np.isin(reasons, CONVERGED).all(axis=0))

    @property
    def candidate(self) -> Candidate:
        """The fitted bodies and cameras."""
        return Candidate(self.problem, self.variables)


def fit(
    problem: Problem,
    variables: Variables,
    config: FitConfig,
    progress: Callable[[str, int], None] | None = None,
    trace: bool = False,
) -> Fit:
    """Fit B bodies from `variables` on by the stages of `config`; `progress` hears a stage and how many ended.

    `trace`: report the terms by iteration, for one more evaluation each.
    """
    known = problem.ground is not None
    if config.hypotheses is not None:
        with one_thread():
            return _fit_hypotheses(problem, variables, config, config.hypotheses, known, progress, trace)
    reports = []
    with one_thread():
        for stage in config.stages:
            if stage.find_ground and not known:
                problem = with_ground_under_body(problem, variables)
            problem = with_static_mask(problem, variables)
            variables, report = run_stage(problem, variables, stage, config.terms, progress, trace)
            reports.append(report)
    return Fit(problem, variables, reports)


def _fit_hypotheses(
    problem: Problem,
    variables: Variables,
    config: FitConfig,
    weighing: Hypotheses,
    known_ground: bool,
    progress: Callable[[str, int], None] | None,
    trace: bool,
) -> Fit:
    """`fit` with several rows for each body from one stage on, of which the cheapest go on after each."""
    first = [stage.name for stage in config.stages].index(weighing.before)
    single = fit(problem, variables, replace(config, stages=config.stages[:first], hypotheses=None), progress, trace)
    problem, variables, rows = hypotheses.expand(single.problem, single.variables, weighing)
    rivals = _Rivals(problem, variables, rows, [_turned(report, single.problem, rows) for report in single.stages])
    beaten: list[list[Hypothesis]] = [[] for _ in range(single.problem.num_bodies)]
    for number, stage in enumerate(config.stages[first:]):
        rivals = rivals.on_ground(find=stage.find_ground and not known_ground)
        if number == 0:
            rivals = rivals.take(hypotheses.distinct(rivals.problem))
        told = None if progress is None else _of_people(progress, len(rivals.rows.person) / len(beaten))
        rivals = rivals.run(stage, config.terms, told, trace)
        weighed = rivals.weighed(weighing)
        if stage is not config.stages[-1]:
            rivals = rivals.take(hypotheses.best(weighed, stage.keep))
            for own, each in zip(beaten, weighed, strict=True):
                own[:0] = [worse for _, worse in each[stage.keep :]]
    best = rivals.weighed(weighing)
    winner, second = (np.array([own[min(place, len(own) - 1)][0] for own in best]) for place in (0, 1))
    ranked = [[*(each for _, each in own), *worse] for own, worse in zip(best, beaten, strict=True)]
    return rivals.take(winner).fit(ranked, rivals.take(second).fit(ranked))


@dataclass(frozen=True)
class _Rivals:
    """Fits of several rows for each person, and how they went so far."""

    problem: Problem
    variables: Variables
    rows: hypotheses.Rows
    reports: list[StageReport]

    def take(self, kept: np.ndarray) -> _Rivals:
        index = torch.from_numpy(kept)
        variables = {name: value[index] for name, value in self.variables.items()}
        reports = [report.take(kept) for report in self.reports]
        return _Rivals(self.problem.rows(index), variables, self.rows.take(kept), reports)

    def on_ground(self, find: bool) -> _Rivals:
        """With a floor under each body, if it is to be found, and what is down on it."""
        problem = with_ground_under_body(self.problem, self.variables) if find else self.problem
        return replace(self, problem=hypotheses.with_contacts(problem, self.variables))

    def run(
        self,
        stage: Stage,
        terms: Mapping[str, Mapping[str, Any]],
        progress: Callable[[str, int], None] | None,
        trace: bool,
    ) -> _Rivals:
        variables, report = run_stage(self.problem, self.variables, stage, terms, progress, trace)
        return replace(self, variables=variables, reports=[*self.reports, report])

    def weighed(self, weighing: Hypotheses) -> list[list[tuple[int, Hypothesis]]]:
        return hypotheses.weigh(self.reports[-1].terms, self.rows, weighing)

    def fit(self, ranked: list[list[Hypothesis]], runner_up: Fit | None = None) -> Fit:
        return Fit(self.problem, self.variables, self.reports, ranked, runner_up)


def _turned(report: StageReport, problem: Problem, rows: hypotheses.Rows) -> StageReport:
    """A report of the stages before the hypotheses, for the rows, its bodies turned as the camera of each is."""
    report, problem = report.take(rows.person), problem.rows(torch.from_numpy(rows.person))
    return replace(report, variables=hypotheses.turn(problem, report.variables, rows)[1])


def _of_people(progress: Callable[[str, int], None], rows: float) -> Callable[[str, int], None]:
    """Progress in people, told that in rows, of which each person has some."""
    return lambda stage, ended: progress(stage, int(ended / rows))


def with_ground_under_body(problem: Problem, variables: Variables) -> Problem:
    """The problem with a level ground under the lowest vertex of each body."""
    with torch.no_grad():
        return replace(problem, ground=ipt.Ground.under(Candidate(problem, variables).vertices))


def with_static_mask(problem: Problem, variables: Variables) -> Problem:
    """Copy of the problem with `static` recomputed from the current bodies; unchanged if the ground is unknown."""
    if problem.ground is None:
        return problem
    with torch.no_grad():
        vertices = Candidate(problem, variables).vertices
        return replace(problem, static=static_gate.static_mask(vertices, problem.body.template, problem.ground))


def run_stage(
    problem: Problem,
    variables: Variables,
    stage: Stage,
    terms: Mapping[str, Mapping[str, Any]],
    progress: Callable[[str, int], None] | None = None,
    trace: bool = False,
) -> tuple[dict[str, torch.Tensor], StageReport]:
    objective = Objective(problem, variables, stage.free, stage.weights, stage.term_options(terms))
    starts = pack(variables, stage.free).numpy()
    outcomes: list[Outcome] = []
    traces: list[dict[str, np.ndarray]] = []
    for first in range(0, len(starts), CHUNK):
        part = _Shrinking(objective.rows(range(first, min(first + CHUNK, len(starts)))), stage.solver == "levenberg")
        on_ended = None if progress is None else (lambda ended, first=first: progress(stage.name, first + ended))
        outcomes += minimise(SOLVERS[stage.solver], starts[first : first + CHUNK], part, stage.options, on_ended)
        traces += part.trace() if trace else []
    rows = torch.from_numpy(np.stack([outcome.point for outcome in outcomes]))
    variables = unpack(rows, stage.free, variables)
    with torch.no_grad():
        costs = objective.costs(objective.candidate(rows))
    reasons, iterations = [outcome.reason for outcome in outcomes], [outcome.iterations for outcome in outcomes]
    ended = {name: cost.numpy() for name, cost in costs.items()}
    return variables, StageReport(stage.name, reasons, iterations, ended, variables, traces if trace else None)


class _Shrinking:
    """An objective's evaluation for the bodies that still run, made anew when half of them have ended."""

    def __init__(self, objective: Objective, wants_models: bool):
        self.whole, self.wants_models = objective, wants_models
        self.bodies: Sequence[int] = range(objective.problem.num_bodies)
        self.objective = objective
        self.best: list[list[tuple[float, np.ndarray]]] = [[] for _ in self.bodies]

    def __call__(self, bodies: Sequence[int], points: np.ndarray) -> list[ValueAndGradient]:
        if 2 * len(bodies) <= len(self.bodies):
            self.bodies, self.objective = bodies, self.whole.rows(bodies)
        place = [self.bodies.index(body) for body in bodies]
        everywhere = np.repeat(points[:1], len(self.bodies), axis=0)
        everywhere[place] = points
        evaluations = self.objective.models(everywhere) if self.wants_models else self.objective.evaluations(everywhere)
        for body, point, i in zip(bodies, points, place, strict=True):
            if evaluations[i].finite and (not self.best[body] or evaluations[i].value < self.best[body][-1][0]):
                self.best[body].append((evaluations[i].value, point))
        return [evaluations[i] for i in place]

    def trace(self) -> list[dict[str, np.ndarray]]:
        """The weighted costs of each body's points that were the best so far: what its solver accepted."""
        lengths = [len(best) for best in self.best]
        nowhere = pack(self.whole.variables, self.whole.free).numpy()
        columns = []
        with torch.no_grad():
            for step in range(max(lengths)):
                rows = [best[min(step, len(best) - 1)][1] if best else nowhere[i] for i, best in enumerate(self.best)]
                columns.append(self.whole.costs(self.whole.candidate(torch.from_numpy(np.stack(rows)))))
        names = self.whole.weights if columns else ()
        costs = {name: torch.stack([column[name] for column in columns]).numpy() for name in names}
        return [{name: cost[:length, body] for name, cost in costs.items()} for body, length in enumerate(lengths)]
