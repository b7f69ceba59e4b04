"""Joints from vertices by a linear regressor, as the literature reports them: J (K, 3) = R (K, V) · V (V, 3).

The files are SPIN's, told apart by their number of rows: `J_regressor_h36m.npy` (17, V), Human3.6M's joints, and
`J_regressor_extra.npy` (9, V), the joints that other data sets label and SMPL does not have.
"""

from __future__ import annotations

import os
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..files import safe_npz

# By SPIN's names of its 24 joints, in which Human3.6M's last of the head is "Head (H36M)", not LSP's top of the head.
HUMAN36M = (
    "pelvis", "right_hip", "right_knee", "right_ankle", "left_hip", "left_knee", "left_ankle", "spine", "neck",
    "jaw", "head", "left_shoulder", "left_elbow", "left_wrist", "right_shoulder", "right_elbow", "right_wrist",
)  # fmt: skip
EXTRA = ("right_hip", "left_hip", "neck", "head_top", "pelvis", "thorax", "spine", "jaw", "head")
_NAMES = {len(names): names for names in (HUMAN36M, EXTRA)}


@dataclass(frozen=True, eq=False)
class JointRegressor:
    """`weights` (K, V) and the names (K,) of their joints."""

    weights: NDArray[np.float64]
    names: tuple[str, ...]

    def joints(self, vertices: NDArray[np.floating]) -> NDArray[np.float64]:
        """Joints (..., K, 3) m of vertices (..., V, 3) m. ValueError for a mesh with another number of vertices."""
        if vertices.shape[-2] != self.weights.shape[1]:
            raise ValueError(f"regressor: is for {self.weights.shape[1]} vertices, but a body has {vertices.shape[-2]}")
        # einsum sums in one order whatever the number of bodies; a matrix product does not.
        return np.einsum("kv,...vc->...kc", self.weights, vertices.astype(np.float64))


def read(path: str | os.PathLike[str]) -> JointRegressor:
    """A regressor from an .npy file. ValueError, naming the file, for one that is damaged or not of 17 or 9 rows."""
    try:
        weights = safe_npz.read_npy(path)
    except ValueError as error:
        raise ValueError(
            f"{path}: the regressor cannot be read ({error}); expected J_regressor_h36m.npy or J_regressor_extra.npy"
        ) from error
    if (
        not isinstance(weights, np.ndarray)
        or weights.ndim != 2
        or len(weights) not in _NAMES
        or weights.dtype.kind != "f"
    ):
        what = f"{weights.dtype} {weights.shape}" if isinstance(weights, np.ndarray) else type(weights).__name__
        raise ValueError(f"{path}: expected a regressor of 17 (Human3.6M) or 9 rows (SPIN's extra joints), got {what}")
    return JointRegressor(weights.astype(np.float64), _NAMES[len(weights)])
