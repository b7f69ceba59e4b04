"""Hand poses of SMPL+H and SMPL-X: their mean and their principal components."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

JOINTS_PER_HAND = 15


@dataclass(frozen=True, eq=False)
class Hands:
    """The hands are the last 30 joints of a model, left before right.

    `mean` (30, 3) is added to every axis-angle pose, as the `smplx` package does by default (zero for a model loaded
    with `flat_hand_mean=True`). `left_components`, `right_components` (K, 45) are directions in axis-angle space.
    """

    mean: NDArray[np.float64]
    left_components: NDArray[np.float64]
    right_components: NDArray[np.float64]

    def from_components(self, left: ArrayLike, right: ArrayLike) -> NDArray[np.float64]:
        """Axis-angle pose (..., 30, 3) of both hands from the weights (..., k <= K) of the first k components of each.

        The mean is not in it: the body model adds it. Raises ValueError when there are more weights than components.
        """
        sides = []
        for name, weights, components in (
            ("left", left, self.left_components),
            ("right", right, self.right_components),
        ):
            weights = np.asarray(weights, float)
            count = weights.shape[-1] if weights.ndim else 0
            if not 1 <= count <= len(components):
                raise ValueError(
                    f"{name}: expected 1 to {len(components)} component weights in the last dimension, got shape "
                    f"{weights.shape}"
                )
            sides.append((weights @ components[:count]).reshape(*weights.shape[:-1], JOINTS_PER_HAND, 3))
        return np.concatenate(sides, -2)
