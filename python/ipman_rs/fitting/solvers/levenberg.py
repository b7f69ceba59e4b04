"""Levenberg-Marquardt with Nielsen's damping: some twenty evaluations where L-BFGS takes hundreds.

Madsen, Nielsen & Tingleff, Methods for Non-Linear Least Squares Problems, 2004, algorithm 3.16.
"""

from __future__ import annotations

from collections.abc import Callable, Generator
from typing import Any

import numpy as np
import scipy.linalg

from .outcome import Outcome, SolverOptions, ValueAndGradient, Vector

STILL = 3  # iterations with hardly any decrease that count as the end
START, STIFFEST = 1e-3, 1e12  # damping


def levenberg(
    start: Vector, options: SolverOptions, solve: Callable[[Any, float], tuple[Vector, float]] | None = None
) -> Generator[Vector, ValueAndGradient, Outcome]:
    """Looks must carry a model of the Hessian, positive semidefinite. A step that does not end lower is undone.

    `solve`: (evaluation, damping) -> step and the decrease it promises, for Hessians that are no plain matrix.
    """
    solve = solve or _step
    point, evaluation = start, (yield start)
    if not evaluation.finite:
        return Outcome(start, evaluation.value, 0, "not finite")
    damping, growth, still = START, 2.0, 0
    for iteration in range(options.iterations):
        if np.abs(evaluation.gradient).max(initial=0) <= options.gradient:
            return Outcome(point, evaluation.value, iteration, "gradient")
        step, promised = solve(evaluation, damping)
        new = yield point + step
        gain = (evaluation.value - new.value) / promised if new.finite and promised > 0 else -1.0
        if gain <= 0:
            damping, growth = damping * growth, 2 * growth
            if damping > STIFFEST:
                return Outcome(point, evaluation.value, iteration + 1, "no descent")
            continue
        still = still + 1 if evaluation.value - new.value <= options.decrease else 0
        point, evaluation = point + step, new
        damping, growth = damping * max(1 / 3, 1 - (2 * gain - 1) ** 3), 2.0
        if still == STILL:
            return Outcome(point, evaluation.value, iteration + 1, "decrease")
    return Outcome(point, evaluation.value, options.iterations, "iterations")


def _step(evaluation: ValueAndGradient, damping: float) -> tuple[Vector, float]:
    """(H + μ diag H) step = −gradient, and the decrease that the model promises."""
    hessian = evaluation.hessian
    if hessian is None:
        raise ValueError("levenberg: expected a model of the Hessian, got none")
    diagonal = hessian.diagonal()
    stiff = damping * np.maximum(diagonal, 1e-6 * diagonal.max(initial=0) + 1e-12)
    try:
        step = -scipy.linalg.cho_solve(scipy.linalg.cho_factor(hessian + np.diag(stiff)), evaluation.gradient)
    except scipy.linalg.LinAlgError:  # not positive definite: more damping
        return np.zeros_like(evaluation.gradient), 0.0
    return step, float(-evaluation.gradient @ step - 0.5 * step @ hessian @ step)
