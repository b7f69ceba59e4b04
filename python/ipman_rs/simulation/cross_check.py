"""Simulation by other engines, for comparison with the built-in one; they get the bodies in axes of their own."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence

import numpy as np

from .drop import Array, Drop, UprightDrop


def each_drop(
    engine: str, drops: Mapping[int, Drop], looks: Sequence[int], step: float, friction: float
) -> Iterator[tuple[int, Array]]:
    """For each body its places (1 + T, 12): centre and rotation at the start and after `looks` steps.

    Raises ImportError with what to install.
    """
    run = _engine(engine)
    for body, drop in drops.items():
        placements = run(UprightDrop.of(drop), looks, step, friction)
        axes = drop.axes()
        foot = drop.center - (drop.center @ drop.normal - drop.height) * drop.normal
        places = np.empty((1 + len(looks), 12))
        for row, (center, rotation) in zip(places, placements, strict=True):
            row[:3] = foot + center @ axes
            row[3:] = (axes.T @ rotation @ axes).ravel()
        yield body, places


def _engine(engine: str):
    try:
        if engine == "bullet":
            from .bullet_engine import run
        else:
            from .mujoco_engine import run
    except ImportError as error:
        message = f"engine {engine!r} needs another package: pip install 'ipman_rs[{engine}]' ({error})"
        raise ImportError(message) from error
    return run
