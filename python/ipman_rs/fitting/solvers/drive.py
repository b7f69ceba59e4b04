"""Runs one solver per body; the objective is evaluated for all of them in one batch."""

from __future__ import annotations

from collections.abc import Callable, Generator, Sequence

import numpy as np

from .outcome import Outcome, SolverOptions, ValueAndGradient, Vector

Solver = Generator[Vector, ValueAndGradient, Outcome]
# The bodies' indices and their points (n, P) -> the value and gradient of each.
Evaluate = Callable[[Sequence[int], Vector], Sequence[ValueAndGradient]]


def minimise(
    solver: Callable[[Vector, SolverOptions], Solver],
    starts: Vector,
    evaluate: Evaluate,
    options: SolverOptions,
    progress: Callable[[int], None] | None = None,
) -> list[Outcome]:
    """One `Outcome` per row of `starts` (B, P). `progress` is called with the number of bodies that have finished."""
    running = {body: solver(start, options) for body, start in enumerate(starts)}
    points = {body: next(generator) for body, generator in running.items()}
    outcomes: dict[int, Outcome] = {}
    while points:
        bodies = sorted(points)
        evaluations = evaluate(bodies, np.stack([points[body] for body in bodies]))
        for body, evaluation in zip(bodies, evaluations, strict=True):
            try:
                points[body] = running[body].send(evaluation)
            except StopIteration as stop:
                outcomes[body] = stop.value
                del points[body]
        if progress is not None:
            progress(len(outcomes))
    return [outcomes[body] for body in range(len(starts))]
