"""The variants compared: presets, some without some of their terms."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import dataclass, replace

from ...fitting.config import FitConfig, limit_iterations, load
from ...fitting.terms import PHYSICS


@dataclass(frozen=True)
class FittingVariant:
    """preset: less the terms of `without`. snap: the fitted body is then put onto the floor."""

    name: str
    preset: str
    without: tuple[str, ...] = ()
    snap: bool = False


def rows(literal: str, with_physics: str, ours: str) -> list[FittingVariant]:
    """Baseline: the preset with both terms less them, so that all rows free the same variables in the same stages."""
    return [
        FittingVariant("baseline", with_physics, PHYSICS),
        FittingVariant("+ ground", with_physics, ("stability",)),
        FittingVariant("+ stability", with_physics, ("ground",)),
        FittingVariant("both", with_physics),
        FittingVariant("ours", ours),
        FittingVariant("ours without physics", ours, PHYSICS),
        FittingVariant("as published", literal),
        FittingVariant("baseline, snapped", with_physics, PHYSICS, snap=True),
    ]


CALIBRATED = rows("smplify-x", "ipman-o-star", "fast")
PRESENTED = rows("smplify-xmc", "ipman-o", "balanced")


def config(row: FittingVariant, iterations: int) -> FitConfig:
    """The preset of a row; stages that would run longer end after `iterations`."""
    preset = limit_iterations(load(row.preset), iterations)
    stages = (replace(stage, weights=_less(stage.weights, row.without)) for stage in preset.stages)
    return replace(preset, stages=tuple(stages))


def _less(weights: Mapping[str, float], names: Collection[str]) -> dict[str, float]:
    return {name: weight for name, weight in weights.items() if name not in names}


__all__ = ["CALIBRATED", "PRESENTED", "FittingVariant", "config", "rows"]
