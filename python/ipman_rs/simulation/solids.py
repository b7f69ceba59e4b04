"""Posed bodies as rigid solids, in the core's layout."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ipman_rs.status import Status

CONTACT = 0.1  # m


@dataclass(frozen=True, eq=False)
class Solids:
    """B bodies: status (B,), mass (B,) kg, center (B, 3) m, inertia (B, 3, 3) kg m², lowest (B,) m above the ground."""

    status: NDArray[np.int64]
    mass: NDArray[np.float64]
    center: NDArray[np.float64]
    inertia: NDArray[np.float64]
    lowest: NDArray[np.float64]

    @classmethod
    def of_rows(cls, rows: NDArray[np.float64]) -> Solids:
        return cls(
            status=rows[:, 0].astype(np.int64),
            mass=rows[:, 1].copy(),
            center=rows[:, 2:5].copy(),
            inertia=rows[:, 5:14].reshape(-1, 3, 3).copy(),
            lowest=rows[:, 14].copy(),
        )

    @property
    def is_solid(self) -> NDArray[np.bool_]:
        return (self.status & (Status.NON_FINITE | Status.NO_VOLUME)) == 0
