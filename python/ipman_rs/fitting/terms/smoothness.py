"""Smoothness of a recording: the mean over points of the body of |acceleration|², m/s², summed over the frames.

With order 1 it is the velocity. The points are all joints and the named points of the skin, in the world: so nothing
depends on how rotations are written down, and a turn through 180° is as smooth as any other.

It couples frames, so it is not one of `TERMS`, whose rows are independent of each other; `sequence` adds it.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import torch
from numpy.typing import NDArray

import ipman_rs.torch as ipt
from ipman_rs.checks import positive

from ...body.landmarks import MIDPOINTS
from ..candidate import Candidate
from ..landmarks import Landmarks, landmark_names
from ..problem import Problem
from ..variables import Variables

DIFFERENCES = {1: (-1.0, 1.0), 2: (1.0, -2.0, 1.0)}
Array = NDArray[np.float64]


class Smoothness:
    """Of T frames, `rate` a second. With x (T, R) the points' coordinates it is Σ xᵀ Q x, Q a band (T, T).

    `band` (order + 1, T): Q's diagonals, Q[s, s + k] = band[k, s].
    """

    def __init__(self, body: ipt.BodyModel, frames: int, rate: float = 1.0, order: int = 2):
        if order not in DIFFERENCES:
            raise ValueError(f"order: expected 1 (velocity) or 2 (acceleration), got {order!r}")
        self.points = Landmarks(body, [name for name in landmark_names(body.body) if name not in MIDPOINTS])
        self.band = np.zeros((order + 1, frames))
        factors = np.array(DIFFERENCES[order]) * positive("rate", rate, "frames a second") ** order
        for first in range(frames - order):
            for k in range(order + 1):
                self.band[k, first : first + order + 1 - k] += factors[k:] * factors[: order + 1 - k]
        self.band /= len(self.points.names)

    def linearised(self, problem: Problem, variables: Variables, free: Sequence[str]) -> tuple[Array, Array]:
        """The points' coordinates x (T, R) and their derivatives (T, P, R) by the free blocks of their frame."""
        candidate = Candidate(replace(problem, landmarks=self.points), variables)
        with torch.no_grad():
            return candidate.landmarks.flatten(1).numpy(), candidate.landmark_slopes(free).flatten(2).numpy()

    def pull(self, x: Array) -> Array:
        """Q x (T, ...): half the cost's derivative by the coordinates."""
        result = np.zeros_like(x)
        for k, diagonal in enumerate(self.band):
            weight = diagonal[: len(x) - k].reshape(-1, *[1] * (x.ndim - 1))
            result[: len(x) - k] += weight * x[k:]
            if k:
                result[k:] += weight * x[: len(x) - k]
        return result

    def cost(self, x: Array) -> float:
        """Of coordinates (T, R)."""
        return float((x * self.pull(x)).sum())
