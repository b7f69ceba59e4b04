"""Which joints of two skeletons are compared: those of one name, or those that a regressor makes of the vertices."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .models import Bodies

# The rows of the regressor J_regressor_h36m.npy of Human3.6M's joints, and those of them that are counted: the 14 that
# LSP has, too, by which the literature compares. The pelvis is the root, and not counted.
HUMAN36M = (
    "pelvis", "right_hip", "right_knee", "right_ankle", "left_hip", "left_knee", "left_ankle", "spine", "neck",
    "jaw", "head_top", "left_shoulder", "left_elbow", "left_wrist", "right_shoulder", "right_elbow", "right_wrist",
)  # fmt: skip
COUNTED = (
    "right_ankle", "right_knee", "right_hip", "left_hip", "left_knee", "left_ankle", "right_wrist", "right_elbow",
    "right_shoulder", "left_shoulder", "left_elbow", "left_wrist", "neck", "head_top",
)  # fmt: skip


@dataclass(frozen=True)
class Compared:
    """Joints (F, K, 3) of the same names, and the pelvis (F, 3) of each."""

    names: tuple[str, ...]
    true: NDArray[Any]
    estimated: NDArray[Any]
    true_root: NDArray[Any]
    root: NDArray[Any]


def joints_of(truth: Bodies, guess: Bodies, known: frozenset[str], regressor: NDArray[Any] | None) -> Compared | None:
    """The joints that two bodies share; None where there are fewer than three, or no pelvis and no hips.

    known: those that the data set has numbers for, of the ones that it names.
    """
    truth = Bodies(truth.vertices, truth.joints, tuple(n if n in known else "" for n in truth.joint_names), truth.model)
    if regressor is not None:
        measured = {*COUNTED} <= {*truth.joint_names}  # by the data set, which goes before its own body's
        truth, guess = truth if measured else _regressed(truth, regressor), _regressed(guess, regressor)
    if truth.joints is None or guess.joints is None:
        return None
    shared = tuple(name for name in truth.joint_names if name and name in guess.joint_names)
    roots = next((each for each in (("pelvis",), ("left_hip", "right_hip")) if {*each} <= {*shared}), None)
    names = tuple(name for name in COUNTED if name in shared) if regressor is not None else shared
    if roots is None or len(names) < 3:
        return None
    return Compared(
        names,
        named(truth, names),
        named(guess, names),
        named(truth, roots).mean(axis=1),
        named(guess, roots).mean(axis=1),
    )


def read_regressor(path: Path) -> NDArray[np.floating]:
    """The (17, V) matrix that makes Human3.6M's joints of SMPL's vertices, from an .npy file. ValueError naming it."""
    try:
        found = np.load(path, allow_pickle=False)
    except (OSError, ValueError) as error:
        raise ValueError(f"{path}: the regressor cannot be read ({error}); expected J_regressor_h36m.npy") from error
    if found.ndim != 2 or found.shape[0] != len(HUMAN36M) or found.dtype.kind != "f":
        raise ValueError(f"{path}: expected a regressor of {len(HUMAN36M)} rows, got {found.dtype} {found.shape}")
    return found.astype(np.float64)


def _regressed(bodies: Bodies, regressor: NDArray[Any]) -> Bodies:
    """The same with the joints of the regressor, where there are vertices."""
    if bodies.vertices is None:
        return bodies
    if bodies.vertices.shape[1] != regressor.shape[1]:
        raise ValueError(f"regressor: is for {regressor.shape[1]} vertices, but a body has {bodies.vertices.shape[1]}")
    # einsum sums in one order whatever the number of bodies; a matrix product does not.
    joints = np.einsum("kv,fvc->fkc", regressor, bodies.vertices.astype(np.float64))
    return Bodies(bodies.vertices, joints, HUMAN36M, bodies.model)


def named(bodies: Bodies, names: tuple[str, ...]) -> NDArray[Any]:
    """Joints (F, K, 3) of these names. ValueError where there are none."""
    if bodies.joints is None:
        raise ValueError("joints: expected some")
    return bodies.joints[:, [bodies.joint_names.index(name) for name in names]]
