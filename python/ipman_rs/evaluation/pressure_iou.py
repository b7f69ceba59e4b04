"""Pressure IoU: overlap of the cells that an estimated body loads with those that a mat measured."""

from __future__ import annotations

from typing import Any, Literal

import numpy as np
from numpy.typing import ArrayLike

from ipman_rs.checks import choice, real_array

from .numpy_or_torch import numpy_or_torch
from .points import Array
from .pressure_map import normalised

PressureMode = Literal["paper", "released"]

THRESHOLDS = np.linspace(0.0, 1.0, 10)


@numpy_or_torch
def pressure_iou(estimated: ArrayLike, measured: ArrayLike, pressure_mode: PressureMode = "paper") -> Any:
    """Intersection over union of the cells above a threshold, the best of ten from 0 to 1: maps (..., H, W) -> (...).

    Both maps are first scaled to run from 0 to 1; "released" takes the measured one in its own unit instead, as the
    authors' code does. NaN where a map is not finite or nothing was measured. A threshold that no cell of either
    reaches counts 0.

    Raises:
        ValueError: the shapes differ.
    """
    first, second = scaled_maps(estimated, measured, pressure_mode)
    return best_iou(first, second)


@numpy_or_torch
def frame_difference(estimated: ArrayLike, measured: ArrayLike, pressure_mode: PressureMode = "paper") -> Any:
    """Mean absolute difference of the cells of both maps, scaled as in `pressure_iou`: (..., H, W) -> (...)."""
    first, second = scaled_maps(estimated, measured, pressure_mode)
    return np.abs(first - second).mean(axis=(-2, -1))


def scaled_maps(estimated: ArrayLike, measured: ArrayLike, pressure_mode: PressureMode) -> tuple[Array, Array]:
    """Both maps, scaled; the measured one is NaN if nothing was measured."""
    choice("pressure_mode", pressure_mode, PressureMode)
    first, second = real_array("estimated", estimated).astype(float), real_array("measured", measured).astype(float)
    if first.shape != second.shape or first.ndim < 2 or 0 in first.shape[-2:]:
        raise ValueError(f"maps: expected two arrays of one shape (..., H, W), got {first.shape} and {second.shape}")
    return normalised(first, (-2, -1)), scaled_measurement(second, pressure_mode)


def scaled_measurement(values: Array, pressure_mode: PressureMode) -> Array:
    """Measured maps (..., H, W), scaled as the mode says; NaN if all cells are equal, so that nothing was measured."""
    nothing = ~(values.max(axis=(-2, -1), keepdims=True) > values.min(axis=(-2, -1), keepdims=True))
    scaled = normalised(values, (-2, -1)) if pressure_mode == "paper" else values
    return np.where(nothing, np.nan, scaled)


def best_iou(first: Array, second: Array) -> Array:
    """The largest IoU over `THRESHOLDS`, (...), of maps (..., H, W), which may broadcast."""
    ious = []
    for threshold in THRESHOLDS:
        one, other = first > threshold, second > threshold
        either = (one | other).sum(axis=(-2, -1))
        ious.append((one & other).sum(axis=(-2, -1)) / np.maximum(either, 1))
    unknown = np.isnan(first).any(axis=(-2, -1)) | np.isnan(second).any(axis=(-2, -1))
    return np.where(unknown, np.nan, np.max(ious, axis=0))
