"""Levenberg-Marquardt with Nielsen's damping: some twenty evaluations where L-BFGS takes hundreds.

Madsen, Nielsen & Tingleff, Methods for Non-Linear Least Squares Problems, 2004, algorithm 3.16.
"""

from __future__ import annotations

from collections.abc import Callable, Generator
from typing import Any

import numpy as np
import scipy.linalg

from .outcome import Evaluation, Options, Outcome, Vector

STILL = 3  # iterations with hardly any decrease that count as the end
START, STIFFEST = 1e-3, 1e12  # damping


def levenberg(
    start: Vector, options: Options, solve: Callable[[Any, float], tuple[Vector, float]] | None = None
) -> Generator[Vector, Evaluation, Outcome]:
    """Looks must carry a model of the Hessian, positive semidefinite. A step that does not end lower is undone.

    `solve`: (look, damping) -> step and the decrease it promises, for Hessians that are no plain matrix.
    """
    solve = solve or _step
    point, look = start, (yield start)
    if not look.finite:
        return Outcome(start, look.value, 0, "not finite")
    damping, growth, still = START, 2.0, 0
    for iteration in range(options.iterations):
        if np.abs(look.gradient).max(initial=0) <= options.gradient:
            return Outcome(point, look.value, iteration, "gradient")
        step, promised = solve(look, damping)
        new = yield point + step
        gain = (look.value - new.value) / promised if new.finite and promised > 0 else -1.0
        if gain <= 0:
            damping, growth = damping * growth, 2 * growth
            if damping > STIFFEST:
                return Outcome(point, look.value, iteration + 1, "no descent")
            continue
        still = still + 1 if look.value - new.value <= options.decrease else 0
        point, look = point + step, new
        damping, growth = damping * max(1 / 3, 1 - (2 * gain - 1) ** 3), 2.0
        if still == STILL:
            return Outcome(point, look.value, iteration + 1, "decrease")
    return Outcome(point, look.value, options.iterations, "iterations")


def _step(look: Evaluation, damping: float) -> tuple[Vector, float]:
    """(H + μ diag H) step = −gradient, and the decrease that the model promises."""
    hessian = look.hessian
    if hessian is None:
        raise ValueError("levenberg: expected a model of the Hessian, got none")
    diagonal = hessian.diagonal()
    stiff = damping * np.maximum(diagonal, 1e-6 * diagonal.max(initial=0) + 1e-12)
    try:
        step = -scipy.linalg.cho_solve(scipy.linalg.cho_factor(hessian + np.diag(stiff)), look.gradient)
    except scipy.linalg.LinAlgError:  # not positive definite: more damping
        return np.zeros_like(look.gradient), 0.0
    return step, float(-look.gradient @ step - 0.5 * step @ hessian @ step)
