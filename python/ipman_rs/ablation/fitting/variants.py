"""What is compared: presets, less some of their terms."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import dataclass, replace

from ...fitting.config import Config, capped, load

PHYSICS = ("stability", "balance", "ground")


@dataclass(frozen=True)
class Row:
    """preset: less the terms of `without`. snap: the fitted body is then put onto the floor."""

    name: str
    preset: str
    without: tuple[str, ...] = ()
    snap: bool = False


def rows(literal: str, with_physics: str, ours: str) -> list[Row]:
    """Baseline: the preset with both terms less them, so that all rows free the same variables in the same stages."""
    return [
        Row("baseline", with_physics, PHYSICS),
        Row("+ ground", with_physics, ("stability",)),
        Row("+ stability", with_physics, ("ground",)),
        Row("both", with_physics),
        Row("ours", ours),
        Row("ours without physics", ours, PHYSICS),
        Row("as published", literal),
        Row("baseline, snapped", with_physics, PHYSICS, snap=True),
    ]


CALIBRATED = rows("smplify-x", "ipman-o-star", "fast")
PRESENTED = rows("smplify-xmc", "ipman-o", "balanced")


def config(row: Row, iterations: int) -> Config:
    """The preset of a row; stages that would run longer end after `iterations`."""
    preset = capped(load(row.preset), iterations)
    stages = (replace(stage, weights=_less(stage.weights, row.without)) for stage in preset.stages)
    return replace(preset, stages=tuple(stages))


def _less(weights: Mapping[str, float], names: Collection[str]) -> dict[str, float]:
    return {name: weight for name, weight in weights.items() if name not in names}


__all__ = ["CALIBRATED", "PRESENTED", "Row", "config", "rows"]
