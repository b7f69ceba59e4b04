"""The metrics of each frame, as far as the data set and the predictions have what they need.

A metric is one number per frame, NaN where it is undefined (no truth, no contact, a body that is not finite). A metric
that no frame of the data set can have is left out.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

import ipman_rs as ip
from ipman_rs.body import BodyModel
from ipman_rs.body.soles import sole_vertices
from ipman_rs.data.frames import Frames
from ipman_rs.ground import Ground

from .. import bose, com_error, cop_error, foot_skating, hover, moyo, mpjpe, pa_mpjpe, penetration, pve, reasons, tilt
from .joints import Definition, Regressors, paired_joints
from .models import FrameBodies, Models

Columns = dict[str, NDArray[Any]]
Pair = Callable[[slice], tuple[Frames, Frames, NDArray[np.int64]]]  # true and estimated frames, and their numbers

AT_ONCE = 256  # frames whose vertices are in memory together
SOLE = 0.02  # m: thickness of the skin under a foot that may skate
_PELVIS = ("pelvis", "left_hip", "right_hip", "spine1")  # joints that move as one rigid piece
_METHODS = ("exact", "vertex_mean", "sample_mean", "face_area")  # besides pCoM


@dataclass(frozen=True)
class Setup:
    """How frames are compared: the body models that pose them, which joints by which regressors, and the constants of
    the pressure (a name of `presets`)."""

    body_models: Models
    definition: Definition | None  # None: no joints are compared
    regressors: Regressors
    preset: str


def piece_metrics(pair: Pair, setup: Setup, start: int, stop: int) -> Columns:
    """`names`, `sequences`, `why` and the metrics of the frames from `start` to `stop` of a data set, each (n,)."""
    parts = []
    for first in range(start, stop, AT_ONCE):
        last = min(first + AT_ONCE, stop)
        true, estimated, numbers = pair(slice(max(first - 1, 0), last))  # foot skating needs the frame before
        columns = pair_metrics(true, estimated, setup)
        own = slice(int(len(numbers) > 0 and numbers[0] < first), None)
        parts.append({name: column[own] for name, column in columns.items()})
    return join_pieces(parts)


def join_pieces(parts: list[Columns]) -> Columns:
    """The columns of all parts, one part after the other; NaN where a part lacks a metric that another has."""
    names = list(dict.fromkeys(name for part in parts for name in part))
    lengths = [len(part["names"]) for part in parts]
    return {
        name: np.concatenate([part.get(name, np.full(n, np.nan)) for part, n in zip(parts, lengths, strict=True)])
        for name in names
    }


def pair_metrics(true: Frames, estimated: Frames, setup: Setup) -> Columns:
    """The metrics of frames that correspond row by row, (F,) each.

    Raises:
        ValueError: a body model is missing, or shapes do not fit.
    """
    truth, guess = setup.body_models.posed(true), setup.body_models.posed(estimated)
    ground = true.ground if estimated.ground is None else estimated.ground
    why = {"prediction not finite": ~_finite(guess, len(true)), "truth not finite": ~_finite(truth, len(true))}
    columns: Columns = {"names": true.names, "sequences": true.sequences, "why": reasons(why)}
    columns |= _point_errors(truth, guess, setup)
    if ground is not None:
        columns |= _tilt(truth, guess, ground, true.ground or ground)
        if guess.vertices is not None and guess.model is not None:
            columns |= _balance(guess.vertices, guess.model, ground, true)
            columns |= _mass(guess.vertices, guess.model, true)
            columns |= _pressure(guess.vertices, guess.model, ground, true, setup.preset)
            soles = guess.vertices[:, sole_vertices(guess.model.template, SOLE)]
            columns["skating"] = foot_skating(soles, ground, true.sequences)
    return columns


def _finite(bodies: FrameBodies, count: int) -> NDArray[np.bool_]:
    """(F,): all vertices are finite; without vertices, some joint is, because a data set may measure only a few of the
    joints that it names."""
    if bodies.vertices is not None:
        return np.asarray(np.isfinite(bodies.vertices).all(axis=(1, 2)))
    if bodies.joints is None:
        return np.ones(count, bool)
    known: NDArray[np.bool_] = np.logical_and.reduce(np.isfinite(bodies.joints), axis=2)
    return np.asarray(np.logical_or.reduce(known, axis=1))


def _point_errors(truth: FrameBodies, guess: FrameBodies, setup: Setup) -> Columns:
    """Errors of joints and vertices."""
    errors: Columns = {}
    joints = None
    if setup.definition is not None:
        joints = paired_joints(truth, guess, setup.definition, setup.regressors)
        errors["mpjpe"] = pve(joints.estimated, joints.true, joints.root, joints.true_root)
        errors["pa_mpjpe"] = pa_mpjpe(joints.estimated, joints.true)
        errors["mpjpe_world"] = mpjpe(joints.estimated, joints.true, root=None)
    if truth.vertices is not None and guess.vertices is not None and truth.vertices.shape == guess.vertices.shape:
        if joints is not None and setup.definition is not None and setup.definition.same:
            errors["pve"] = pve(guess.vertices, truth.vertices, joints.root, joints.true_root)
        errors["pve_world"] = pve(guess.vertices, truth.vertices)
    return errors


def _tilt(truth: FrameBodies, guess: FrameBodies, ground: Ground, true_ground: Ground) -> Columns:
    if not {*_PELVIS} <= {*truth.joint_names} & {*guess.joint_names}:
        return {}
    return {"tilt": tilt(_pelvis(guess), _pelvis(truth), ground, true_ground)}


def _pelvis(bodies: FrameBodies) -> NDArray[Any]:
    return np.asarray(bodies.joints)[:, [bodies.joint_names.index(name) for name in _PELVIS]]


def _balance(vertices: NDArray[Any], model: BodyModel, ground: Ground, true: Frames) -> Columns:
    template = model.template
    metrics: Columns = {
        "bose": bose(vertices, template, ground),
        "bose_3cm": bose(vertices, template, ground, threshold=0.03),
        "bose_strict": bose(vertices, template, ground, bose_mode="strict"),
        "penetration": penetration(vertices, ground),
        "hover": hover(vertices, ground),
    }
    if true.standing is not None:
        labels = np.asarray(true.standing, float)
        if true.contact is not None:  # −1: in the air, as the authors label it
            labels = np.where(true.contact, labels, -1.0)
        metrics["bose_released"] = bose(vertices, template, ground, bose_mode="released", labels=labels)
    return metrics


def _mass(vertices: NDArray[Any], model: BodyModel, true: Frames) -> Columns:
    """Errors of the centre of mass by each formulation, where a centre was measured."""
    if true.center_of_mass is None:
        return {}
    errors = {"com_error": com_error(ip.center_of_mass(vertices, model.template), true.center_of_mass)}
    for method in _METHODS:
        center = ip.center_of_mass(vertices, model.template, method)
        errors[f"com_error_{method}"] = com_error(center, true.center_of_mass)
    return errors


def _pressure(vertices: NDArray[Any], model: BodyModel, ground: Ground, true: Frames, preset: str) -> Columns:
    """Pressure and its centre against the measurements of a mat or of force plates."""
    if true.center_of_pressure is None:
        return {}
    constants = ip.presets.get(preset)
    if true.pressure is None:
        curve = {"alpha": constants.alpha, "gamma": constants.gamma, "epsilon": constants.epsilon}
        center = ip.center_of_pressure(vertices, model.template, ground, **curve)
        return {"cop_error": cop_error(center, true.center_of_pressure, ground)}
    samples = ip.sample_surface(vertices, model.template)
    results = moyo(samples, ground, true.pressure, true.center_of_pressure, constants.alpha, constants.gamma)
    return {
        "pressure_iou": results.fixed.iou,
        "cop_error": results.fixed.cop_error,
        "pressure_iou_chosen": results.best_iou.iou,
        "cop_error_chosen": results.best_cop_error.cop_error,
    }
