"""Posed bodies of a data set on their ground, read piece by piece."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ipman_rs.body import BodyModel
from ipman_rs.data.frames import DataSet, Frames
from ipman_rs.evaluation.tables.models import Models, file_of
from ipman_rs.ground import Ground

PIECE = 256  # frames

Progress = Callable[[int], None]


class PosedFrames(NamedTuple):
    """Some frames, their vertices (F, V, 3) m in finite numbers, the model whose faces these have, and their ground."""

    frames: Frames
    vertices: NDArray[np.floating]
    model: BodyModel
    ground: Ground


def posed_bodies(
    name: str, data: DataSet, models: Models, rows: NDArray[np.integer], progress: Progress = lambda done: None
) -> Iterator[PosedFrames]:
    """The bodies of these frames of the data set `name`, those without a finite body left out.

    `progress` is called with the number of frames done. ValueError, naming the data set, where it has no ground, no
    bodies, or bodies of a model that is not there.
    """
    for start in range(0, len(rows), PIECE):
        frames = data[rows[start : start + PIECE]]
        if frames.ground is None:
            raise ValueError(f"{name}: has no ground, so nothing can be said of how its people stand")
        bodies = models.posed(frames)
        if bodies.vertices is None or bodies.model is None:
            raise ValueError(f"{name}: {_lacking(frames)}")
        finite = np.flatnonzero(np.isfinite(bodies.vertices).all(axis=(1, 2)))
        done = start + len(frames)
        if len(finite):
            frames = frames[finite]
            assert frames.ground is not None
            yield PosedFrames(frames, bodies.vertices[finite], bodies.model, frames.ground)
        progress(done)


def _lacking(frames: Frames) -> str:
    if frames.body is None or (frames.pose is None and frames.vertices is None):
        return "has no bodies, neither parameters nor vertices of a body model"
    return f"its bodies need the model file {file_of(frames)}.npz or .pkl: give `models=FOLDER`"
