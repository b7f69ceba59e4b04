"""Two methods on the same people, by simulation: how many of their bodies stand, and how far these move.

The paper drops the bodies of IPMAN-O and of SMPLify-XMC on MoYo in Bullet for 100 steps; "a small displacement denotes
a stable pose", and IPMAN-O has 14.8 % more stable bodies. It prints neither a limit of the displacement nor a number of
bodies. Here a body is stable that stands after 2 s, and displacements are compared as they are.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ipman_rs.evaluation.statistics.bootstrap import Interval, bootstrap, paired
from ipman_rs.evaluation.statistics.clusters import differences

from .fall import Simulation

MORE_STABLE_IN_THE_PAPER = 14.8  # %, IPMAN-O against SMPLify-XMC on MoYo


class Means(NamedTuple):
    """A figure's mean over the bodies of either method, the difference first − second and the ratio first / second.

    Intervals are of the paired bootstrap over bodies; NaN where there are fewer than two bodies, and for the ratio also
    where the second mean is 0, in the sample or in one of its resamples.
    """

    first: float
    second: float
    difference: Interval
    ratio: Interval


@dataclass(frozen=True)
class MethodComparison:
    """bodies: how many were simulated by both methods; left_out: how many were not. times: (T,) s.

    stable: the share that stands, None where the simulations end before 2 s. displacement: T figures in metres.
    """

    bodies: int
    left_out: int
    times: NDArray[np.float64]
    stable: Means | None
    displacement: tuple[Means, ...]


def compare(
    first: Simulation, second: Simulation, level: float = 0.95, resamples: int = 10_000, seed: int = 0
) -> MethodComparison:
    """Compare two methods body by body: row i of both simulations is the same person in the same frame.

    A body that one of the two has not simulated (in the air, not finite) is left out for both. Bodies are drawn as if
    each said something of its own: of a recording give some frames, not all.

    Raises:
        ValueError: batches of different shapes, simulations at different times, or no body that both have.
    """
    if first.status.shape != second.status.shape:
        raise ValueError(
            f"second: expected a body for each of the first's {first.status.shape}, got {second.status.shape}"
        )
    if first.times.shape != second.times.shape or (first.times != second.times).any():
        raise ValueError(f"second: expected the first's times {first.times.tolist()}, got {second.times.tolist()}")
    moved = [run.displacement.reshape(-1, len(run.times)) for run in (first, second)]
    known = np.isfinite(moved[0]).all(axis=1) & np.isfinite(moved[1]).all(axis=1)
    if not known.any():
        raise ValueError(f"first, second: expected a body that both simulated, got none of {known.size}")

    def means(one: NDArray[np.float64], other: NDArray[np.float64]) -> Means:
        return _means(one[known], other[known], level, resamples, seed)

    stable = None
    if first.has_verdict:
        stable = means(*((~run.fell()).reshape(-1).astype(float) for run in (first, second)))
    displacement = tuple(means(moved[0][:, k], moved[1][:, k]) for k in range(len(first.times)))
    return MethodComparison(int(known.sum()), int((~known).sum()), first.times, stable, displacement)


def _means(first: NDArray[np.float64], second: NDArray[np.float64], level: float, resamples: int, seed: int) -> Means:
    difference = paired(first, second, level, resamples, seed)
    # Bodies, or clusters of them where there are many: the same for both.
    (_, above, _), (_, below, _) = (differences(values, np.zeros(len(values)), None) for values in (first, second))
    mean = float(first.mean() / second.mean()) if second.any() else np.nan
    with np.errstate(divide="ignore", invalid="ignore"):  # a resample in which the second has nothing but zeros
        ratio = bootstrap(above, below, mean, level, resamples, seed)
    bounded = np.isfinite([mean, ratio.low, ratio.high]).all()
    return Means(
        float(first.mean()), float(second.mean()), difference, ratio if bounded else Interval(mean, np.nan, np.nan)
    )
