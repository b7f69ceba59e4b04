"""Which joints are compared, and how they are obtained on either side.

Where truth and estimate are bodies, the joints of both are computed in the same way: from the vertices by the same
regressor, or, without a regressor, by the body model if both have the same. Joints that a data set measured are
compared only where it has no bodies, or where the estimate has joints but no body; they are then matched by name.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from ipman_rs.body import joint_regressors
from ipman_rs.body.joint_regressors import HUMAN36M, JointRegressor

from .models import FrameBodies

Points = NDArray[Any]
Maker = Literal["given", "own", "extra", "h36m"]

# The 14 of Human3.6M's 17 joints on which the literature reports errors (SPIN's H36M_TO_J14). The pelvis is the root
# and does not count; for MPI-INF-3DHP all 17 count.
COUNTED = (
    "right_ankle", "right_knee", "right_hip", "left_hip", "left_knee", "left_ankle", "right_wrist", "right_elbow",
    "right_shoulder", "left_shoulder", "left_elbow", "left_wrist", "neck", "head",
)  # fmt: skip
ALL_17 = (*COUNTED, "pelvis", "spine", "jaw")
LISTED = 24  # joints that a report lists by name
ROOTS = (("pelvis",), ("left_hip", "right_hip"))
# The regressor that gives a body the joints that a data set measured, and its file.
MEASURED: dict[str, tuple[Maker, str]] = {
    "human36m": ("h36m", "J_regressor_h36m.npy"),
    "mpi-inf-3dhp": ("h36m", "J_regressor_h36m.npy"),
    "rich-ipman": ("extra", "J_regressor_extra.npy"),
}


@dataclass(frozen=True)
class Regressors:
    """The user's joint regressors: for Human3.6M's joints, and for SPIN's extra ones."""

    human36m: JointRegressor | None = None
    extra: JointRegressor | None = None

    @classmethod
    def read(cls, paths: Sequence[str]) -> Regressors:
        """The regressors of these files. ValueError, naming the file, for a damaged one or a second of its kind."""
        regressors: dict[str, JointRegressor] = {}
        for path in paths:
            regressor = joint_regressors.read(path)
            kind = "human36m" if regressor.names == HUMAN36M else "extra"
            if kind in regressors:
                raise ValueError(f"{path}: expected one regressor of {len(regressor.names)} joints, got two")
            regressors[kind] = regressor
        return cls(**regressors)


@dataclass(frozen=True)
class Definition:
    """The joints that are compared.

    names: the joints that count. roots: the pelvis, or both hips; both sides are aligned at their mean. truth,
    estimate: the source of each side's joints: "given" by a file, the body's "own", or a regressor of the vertices
    ("h36m", "extra"). same: both sides have the same definition, so that equal bodies have equal joints. words: all of
    this as a sentence.
    """

    names: tuple[str, ...]
    roots: tuple[str, ...]
    truth: Maker
    estimate: Maker
    same: bool
    words: str


@dataclass(frozen=True)
class PairedJoints:
    """Joints (F, K, 3) m of both sides, under the same names, and the root (F, 3) m of each."""

    true: Points
    estimated: Points
    true_root: Points
    root: Points


def define(
    truth: FrameBodies, estimate: FrameBodies, measured: frozenset[str], regressors: Regressors, data: str
) -> Definition | None:
    """How truth and estimate are compared; None if they share fewer than three joints, or neither pelvis nor hips.

    measured: those of the data set's own joints that are finite in some frame. data: name of the data set.

    Raises:
        ValueError: a body would be compared with joints of another definition, or the body model of the truth is
            missing.
    """
    if truth.missing_model is not None and estimate.vertices is not None and estimate.file_joints is None:
        raise ValueError(
            f"{data}: its truth is bodies of {truth.kind}, to which predicted bodies are compared: `models=FOLDER` "
            f"with {truth.missing_model}.npz or .pkl"
        )
    makers = _makers(truth, estimate, regressors, data)
    if makers is None:
        return None
    theirs = [name for name in _names(truth, makers[0], regressors) if makers[0] != "given" or name in measured]
    ours = {*_names(estimate, makers[1], regressors)}
    shared = tuple(name for name in theirs if name in ours)
    roots = next((each for each in ROOTS if {*each} <= {*shared}), None)
    counted = ALL_17 if data == "mpi-inf-3dhp" else COUNTED
    names = shared if regressors.human36m is None else tuple(name for name in counted if name in shared)
    if roots is None or len(names) < 3:
        return None
    same = _same(truth, estimate, makers)
    return Definition(names, roots, *makers, same, _words(truth, estimate, makers, same, names, roots))


def paired_joints(
    truth: FrameBodies, estimate: FrameBodies, definition: Definition, regressors: Regressors
) -> PairedJoints:
    """The joints of both sides, as the definition says."""
    true = _by_name(truth, definition.truth, regressors)
    guess = _by_name(estimate, definition.estimate, regressors)
    return PairedJoints(
        _stacked(true, definition.names),
        _stacked(guess, definition.names),
        _stacked(true, definition.roots).mean(axis=1),
        _stacked(guess, definition.roots).mean(axis=1),
    )


def _by_name(bodies: FrameBodies, maker: Maker, regressors: Regressors) -> dict[str, Points]:
    points = np.moveaxis(_points(bodies, maker, regressors), 1, 0)
    return dict(zip(_names(bodies, maker, regressors), points, strict=True))


def _stacked(points: dict[str, Points], names: Sequence[str]) -> Points:
    return np.stack([points[name] for name in names], axis=1)


def _makers(truth: FrameBodies, estimate: FrameBodies, regressors: Regressors, data: str) -> tuple[Maker, Maker] | None:
    """The sources of the joints of truth and estimate; None if one has neither joints nor a body."""
    true: Maker | None = None
    guess: Maker | None = None
    if truth.vertices is not None and estimate.vertices is not None:
        true, guess = _maker_of_body(truth, regressors), _maker_of_body(estimate, regressors)
    elif estimate.file_joints is not None:
        true, guess = "given" if truth.file_joints is not None else _maker_of_body(truth, regressors), "given"
    elif truth.file_joints is not None and estimate.vertices is not None:
        true, guess = "given", _maker_as_measured(estimate, regressors, data)
    return None if true is None or guess is None else (true, guess)


def _maker_of_body(bodies: FrameBodies, regressors: Regressors) -> Maker | None:
    if bodies.vertices is not None and regressors.human36m is not None:
        return "h36m"
    if bodies.vertices is not None and regressors.extra is not None:
        return "extra"
    return "own" if bodies.model_joints is not None else "given" if bodies.file_joints is not None else None


def _maker_as_measured(estimate: FrameBodies, regressors: Regressors, data: str) -> Maker | None:
    """How a body gets the joints that a data set measured. ValueError if that needs a regressor."""
    if data not in MEASURED:
        return _maker_of_body(estimate, regressors)
    maker, file = MEASURED[data]
    if (regressors.human36m if maker == "h36m" else regressors.extra) is None:
        raise ValueError(
            f"{data}: has measured joints and no bodies here, and the predictions are bodies, whose own hips, pelvis, "
            f"neck and head are other points: `regressors` with {file} makes the measured ones of the predicted "
            "vertices (or give joints and joint_names beside the pose)"
        )
    return maker


def _names(bodies: FrameBodies, maker: Maker, regressors: Regressors) -> tuple[str, ...]:
    if maker == "given":
        return bodies.file_joint_names
    if maker == "own":
        return bodies.model_joint_names
    if maker == "h36m" and regressors.human36m is not None:
        return regressors.human36m.names
    extra = () if regressors.extra is None else regressors.extra.names
    return (*extra, *(name for name in bodies.model_joint_names if name not in extra))


def _points(bodies: FrameBodies, maker: Maker, regressors: Regressors) -> Points:
    """Joints (F, K, 3) of `_names`."""
    if maker == "given":
        return _required(bodies.file_joints)
    if maker == "own":
        return _required(bodies.model_joints)
    if maker == "h36m" and regressors.human36m is not None:
        return regressors.human36m.joints(_required(bodies.vertices))
    if regressors.extra is None:
        raise ValueError("joints: expected a regressor")
    points = [regressors.extra.joints(_required(bodies.vertices))]
    if bodies.model_joints is not None:
        points.append(bodies.model_joints[:, [name not in regressors.extra.names for name in bodies.model_joint_names]])
    return np.concatenate(points, axis=1)


def _required(points: Points | None) -> Points:
    if points is None:
        raise ValueError("joints: some frames have none, others have them")
    return points


def _same(truth: FrameBodies, estimate: FrameBodies, makers: tuple[Maker, Maker]) -> bool:
    if makers == ("h36m", "h36m"):
        return True
    return makers[0] == makers[1] != "given" and truth.kind == estimate.kind


def _words(
    truth: FrameBodies,
    estimate: FrameBodies,
    makers: tuple[Maker, Maker],
    same: bool,
    names: tuple[str, ...],
    roots: tuple[str, ...],
) -> str:
    true, guess = (
        _maker_words(truth, makers[0], "the data set gives"),
        _maker_words(estimate, makers[1], "the predictions give"),
    )
    by = f"truth and estimate by {true}" if same else f"truth by {true}, estimate by {guess}"
    listed = ", ".join(names) if len(names) <= LISTED else f"{names[0]} to {names[-1]}; evaluation.json names them"
    counted = f"{len(names)} joints ({listed})"
    aligned = f"aligned at the {'pelvis' if roots == ('pelvis',) else 'middle of the hips'}"
    if same or "h36m" in makers or makers == ("given", "given"):
        return f"{counted}; {by}; {aligned}"
    return f"{counted}; {by}; {aligned}. Only the names agree: where definitions differ, errors carry their distance"


def _maker_words(bodies: FrameBodies, maker: Maker, giver: str) -> str:
    """The source of the joints of one side, in words."""
    own = f"the joints of the body {bodies.kind}"
    words: dict[Maker, str] = {
        "given": f"the joints that {giver}",
        "own": own,
        "h36m": "J_regressor_h36m × vertices",
        "extra": "J_regressor_extra × vertices" + (f" and {own}" if bodies.model_joints is not None else ""),
    }
    return words[maker]
