"""L-BFGS with a line search for the strong Wolfe conditions: what SMPLify-X and -XMC solve with.

Nocedal & Wright, Numerical Optimization, 2nd ed., algorithms 7.4, 7.5, 3.5 and 3.6.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Generator

import numpy as np

from .outcome import Outcome, SolverOptions, ValueAndGradient, Vector

MEMORY = 10
SUFFICIENT, CURVATURE = 1e-4, 0.9  # the constants of the Wolfe conditions
TRIES = 20  # of one line search
STILL = 3  # iterations with hardly any decrease that count as the end

Search = Generator[Vector, ValueAndGradient, "tuple[float, ValueAndGradient] | None"]


def lbfgs(start: Vector, options: SolverOptions) -> Generator[Vector, ValueAndGradient, Outcome]:
    """A step that does not end lower is undone and shrunk; the best point is never lost."""
    point, evaluation = start, (yield start)
    if not evaluation.finite:
        return Outcome(start, evaluation.value, 0, "not finite")
    memory: deque[tuple[Vector, Vector]] = deque(maxlen=MEMORY)
    still = 0
    for iteration in range(options.iterations):
        if np.abs(evaluation.gradient).max(initial=0) <= options.gradient:
            return Outcome(point, evaluation.value, iteration, "gradient")
        direction = -_product(memory, evaluation.gradient)
        if direction @ evaluation.gradient >= 0:
            memory.clear()
            direction = -evaluation.gradient
        first = 1.0 if memory else min(1.0, 1.0 / np.abs(evaluation.gradient).sum())
        searched = yield from _search(point, evaluation, direction, first)
        if searched is None:
            if not memory:
                return Outcome(point, evaluation.value, iteration, "no descent")
            memory.clear()
            continue
        step, new = searched
        change, turn = step * direction, new.gradient - evaluation.gradient
        if change @ turn > 1e-10 * (turn @ turn):
            memory.append((change, turn))
        still = still + 1 if evaluation.value - new.value <= options.decrease else 0
        point, evaluation = point + change, new
        if still == STILL:
            return Outcome(point, evaluation.value, iteration + 1, "decrease")
    return Outcome(point, evaluation.value, options.iterations, "iterations")


def _product(memory: deque[tuple[Vector, Vector]], gradient: Vector) -> Vector:
    """The inverse Hessian's estimate times the gradient: the two-loop recursion."""
    result, shares = gradient.copy(), []
    for change, turn in reversed(memory):
        share = (change @ result) / (change @ turn)
        result -= share * turn
        shares.append(share)
    if memory:
        change, turn = memory[-1]
        result *= (change @ turn) / (turn @ turn)
    for (change, turn), share in zip(memory, reversed(shares), strict=True):
        result += (share - (turn @ result) / (change @ turn)) * change
    return result


def _search(point: Vector, start: ValueAndGradient, direction: Vector, step: float) -> Search:
    """A step that satisfies the strong Wolfe conditions, or the lowest that was found; None if nothing is lower."""
    slope = float(start.gradient @ direction)
    low, low_look, high, high_value = 0.0, start, None, np.inf
    for _ in range(TRIES):
        evaluation = yield point + step * direction
        value = evaluation.value if evaluation.finite else np.inf
        if value > start.value + SUFFICIENT * step * slope or value >= low_look.value and low > 0:
            high, high_value = step, value
        else:
            slope_here = float(evaluation.gradient @ direction)
            if abs(slope_here) <= -CURVATURE * slope:
                return step, evaluation
            if slope_here * ((high if high is not None else np.inf) - low) >= 0:
                high, high_value = low, low_look.value
            low, low_look = step, evaluation
        step = 2 * step if high is None else _between(low, low_look, direction, high, high_value)
    return (low, low_look) if low_look.value < start.value else None


def _between(low: float, evaluation: ValueAndGradient, direction: Vector, high: float, high_value: float) -> float:
    """The minimum of the parabola through both values and the slope at `low`, kept away from the ends."""
    width = high - low
    slope = float(evaluation.gradient @ direction)
    curve = high_value - evaluation.value - slope * width
    share = -slope * width / (2 * curve) if np.isfinite(curve) and curve > 0 else 0.5
    return low + width * min(max(share, 0.1), 0.9)
