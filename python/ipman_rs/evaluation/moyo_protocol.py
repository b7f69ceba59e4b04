"""The biomechanics protocol of MoYo: pressure and centre of pressure of a body on a mat.

For every frame the paper chooses the pressure's α and γ, the best of a grid of 150, by that frame's own measurement.
Such an oracle is too favourable, so results with one α and γ for all frames are given, too.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ipman_rs.checks import number

from .numpy_or_torch import AnyGround, as_array, numpy_or_torch
from .points import Array, norm, points, vector
from .pressure_iou import PressureMode, best_iou, scaled_measurement
from .pressure_map import Mat, cell_numbers, normalised

ALPHAS = np.linspace(10.0, 200.0, 10)  # 1/m
GAMMAS = np.linspace(10.0, 5000.0, 15)  # 1/m


class PressureFigures(NamedTuple):
    """Results of F frames, (F,) each: pressure IoU, CoP error (m), mean difference of the maps; the α, γ (1/m) used."""

    iou: Any
    cop_error: Any
    frame_difference: Any
    alpha: Any
    gamma: Any


class MoyoFigures(NamedTuple):
    """Results with the oracle's three choices of α and γ, each by another metric, and with fixed α and γ."""

    best_iou: PressureFigures
    best_cop_error: PressureFigures
    best_frame_difference: PressureFigures
    fixed: PressureFigures


@numpy_or_torch
def moyo(
    samples: ArrayLike,
    ground: AnyGround,
    mat: Mat,
    center_of_pressure: ArrayLike,
    alpha: float = 100.0,
    gamma: float = 10.0,
    pressure_mode: PressureMode = "paper",
) -> Any:
    """MoyoFigures of F bodies. samples (F, S, 3) m on their surfaces (`ipman_rs.sample_surface`).

    The pressure of the samples on the mat is scaled to run from 0 to 1, summed in each cell, and scaled again. The
    centre of pressure is that of all samples. NaN where the body is not finite, nothing was measured, or (CoP error)
    the measured centre is NaN; IoU 0 where no sample lies over the mat.

    Args:
        mat: the measured maps, `values` (F, H, W).
        center_of_pressure: (F, 3) m, measured.
        alpha, gamma: 1/m, of the results with fixed parameters.
        pressure_mode: "released" leaves the measured maps in their own unit, as the authors' code does.

    Raises:
        ValueError: the shapes do not match.
    """
    bodies, centers = points("samples", samples), vector("center_of_pressure", center_of_pressure)
    measured = np.asarray(as_array(mat.values), float)
    if bodies.ndim != 3 or measured.ndim != 3 or centers.ndim != 2 or not len(bodies) == len(measured) == len(centers):
        raise ValueError(
            "samples, mat, center_of_pressure: expected (F, S, 3), values (F, H, W) and (F, 3), "
            f"got {bodies.shape}, {measured.shape} and {centers.shape}"
        )
    own = number("alpha", alpha), number("gamma", gamma)
    heights = ground.signed_height(bodies)
    normals = np.broadcast_to(ground.normal, (len(bodies), 3))
    results = np.full((len(bodies), 4, 5), np.nan)
    for frame, truth in enumerate(scaled_measurement(measured, pressure_mode)):
        if np.isfinite(bodies[frame]).all():
            cells = cell_numbers(bodies[frame], mat, frame)
            frame_of = _Frame(bodies[frame], heights[frame], normals[frame], cells, truth, centers[frame])
            grid = frame_of.figures(ALPHAS, GAMMAS)
            fixed = frame_of.figures(np.array(own[:1]), np.array(own[1:]))
            results[frame] = [*_choices(grid), fixed[0]]
    return MoyoFigures(*(PressureFigures(*row.T) for row in results.transpose(1, 0, 2)))


def _choices(grid: Array) -> list[Array]:
    """Of results (G, 5) those with the largest IoU, the least CoP error and the least difference of the maps; the last
    of equal ones."""
    costs = grid[:, :3] * [-1.0, 1.0, 1.0]
    rows = [len(grid) - 1 - np.argmin(cost[::-1]) for cost in np.nan_to_num(costs, nan=np.inf).T]
    return [np.where(np.isnan(grid[:, figure]).all(), np.nan, grid[row]) for figure, row in enumerate(rows)]


class _Frame:
    """One body over the mat.

    Pressure is 1 − αh below the ground and e^(−γh) above. A sum over all samples is therefore a sum that depends on α
    alone plus one that depends on γ alone, and the grid costs A + G sums, not A · G.
    """

    def __init__(
        self, body: Array, heights: Array, normal: Array, cells: NDArray[np.int64], truth: Array, center: Array
    ) -> None:
        self.body, self.normal, self.truth, self.center = body, normal, truth, center
        self.heights, self.below = heights, heights < 0
        self.cells = cells

    def figures(self, alphas: Array, gammas: Array) -> Array:
        """(A · G, 5), the fields of `PressureFigures`, α changing slowest."""
        a, g = np.meshgrid(alphas, gammas, indexing="ij")
        maps, centers = self._maps(alphas, gammas), self._centers(alphas, gammas)
        offset = centers - self.center
        along = offset - (offset @ self.normal)[..., None] * self.normal
        figures = best_iou(maps, self.truth), norm(along), np.abs(maps - self.truth).mean(axis=(-2, -1)), a, g
        return np.stack(figures, axis=-1).reshape(-1, 5)

    def _centers(self, alphas: Array, gammas: Array) -> Array:
        """Centres of pressure (A, G, 3)."""
        heights = self.heights - max(self.heights.min(), 0.0)  # of a hovering body e^(−γh) would vanish; ratios stay
        moments = np.column_stack([self.body, np.ones(len(self.body))])
        low, high = moments[self.below], moments[~self.below]
        deep = (1 - alphas[:, None] * heights[self.below]) @ low
        above = np.exp(-gammas[:, None] * heights[~self.below]) @ high
        total = deep[:, None] + above[None]
        return total[..., :3] / total[..., 3:]

    def _maps(self, alphas: Array, gammas: Array) -> Array:
        """Maps (A, G, H, W), scaled to run from 0 to 1; 0 where no sample lies over the mat."""
        size = self.truth.size
        on = self.cells >= 0
        if not on.any():
            return np.zeros((len(alphas), len(gammas), *self.truth.shape))
        low, high = on & self.below, on & ~self.below
        deep = [1 - alpha * self.heights[low] for alpha in alphas]
        above = [np.exp(-gamma * self.heights[high]) for gamma in gammas]
        under = np.array([np.bincount(self.cells[low], each, size) for each in deep])
        over = np.array([np.bincount(self.cells[high], each, size) for each in above])
        least = np.minimum(_edge(np.min, deep)[:, None], _edge(np.min, above))
        most = np.maximum(_edge(np.max, deep, -np.inf)[:, None], _edge(np.max, above, -np.inf))
        number = np.bincount(self.cells[on], minlength=size)
        sums = (under[:, None] + over - least[..., None] * number).clip(min=0)
        sums[most <= least] = 0  # but for rounding
        return normalised(sums.reshape(*most.shape, *self.truth.shape), (-2, -1))


def _edge(kind: Any, rows: list[Array], empty: float = np.inf) -> Array:
    return np.array([kind(row, initial=empty) for row in rows])
