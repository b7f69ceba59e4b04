"""The figures of some frames: what can be said of them, given what the data set and the predictions have.

A figure is a number a frame, NaN where it is undefined (no truth, no contact, a body that is not finite); one that no
frame of the data set can have is not there at all.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

import ipman_rs as ip
from ipman_rs.body import BodyModel
from ipman_rs.body.soles import sole_vertices
from ipman_rs.data.frames import Frames
from ipman_rs.ground import Ground

from .. import bose, com_error, cop_error, foot_skating, hover, moyo, mpjpe, pa_mpjpe, penetration, pve, reasons, tilt
from .joints import paired_joints
from .models import FrameBodies

if TYPE_CHECKING:
    from .job import Job

Columns = dict[str, NDArray[Any]]

AT_ONCE = 256  # frames whose vertices lie in memory together
SOLE = 0.02  # m: so thick is the skin under a foot that may skate
_PELVIS = ("pelvis", "left_hip", "right_hip", "spine1")  # one rigid piece
_METHODS = ("exact", "vertex_mean", "sample_mean", "face_area")  # beside pCoM


def piece_metrics(job: Job, start: int, stop: int) -> Columns:
    """`names`, `sequences` and the figures of the frames from `start` to `stop` of a job's data set, each (n,)."""
    parts = []
    for first in range(start, stop, AT_ONCE):
        last = min(first + AT_ONCE, stop)
        true, estimated, kept = job.pair(slice(max(first - 1, 0), last))  # skating: from the frame before
        found = pair_metrics(true, estimated, job)
        own = slice(int(len(kept) > 0 and kept[0] < first), None)
        parts.append({name: value[own] for name, value in found.items()})
    return join_pieces(parts)


def join_pieces(parts: list[Columns]) -> Columns:
    """One after the other; NaN where a part lacks a figure that another has."""
    known = list(dict.fromkeys(name for part in parts for name in part))
    lengths = [len(part["names"]) for part in parts]
    return {
        name: np.concatenate([part.get(name, np.full(n, np.nan)) for part, n in zip(parts, lengths, strict=True)])
        for name in known
    }


def pair_metrics(true: Frames, estimated: Frames, job: Job) -> Columns:
    """Of frames that belong together row by row. ValueError where a body model is missing or shapes do not fit."""
    truth, guess = job.bodies.posed(true), job.bodies.posed(estimated)
    ground = true.ground if estimated.ground is None else estimated.ground
    unknown = {"prediction not finite": ~_finite(guess, len(true)), "truth not finite": ~_finite(truth, len(true))}
    found: Columns = {"names": true.names, "sequences": true.sequences, "why": reasons(unknown)}
    found |= _points(truth, guess, job)
    if ground is not None:
        found |= _tilt(truth, guess, ground, true.ground or ground)
        if guess.vertices is not None and guess.model is not None:
            found |= _balance(guess.vertices, guess.model, ground, true)
            found |= _mass(guess.vertices, guess.model, true)
            found |= _pressure(guess.vertices, guess.model, ground, true, job.preset)
            soles = guess.vertices[:, sole_vertices(guess.model.template, SOLE)]
            found["skating"] = foot_skating(soles, ground, true.sequences)
    return found


def _finite(bodies: FrameBodies, count: int) -> NDArray[np.bool_]:
    """Of vertices all; of joints some, for a data set may know a few of those that it names."""
    if bodies.vertices is not None:
        return np.asarray(np.isfinite(bodies.vertices).all(axis=(1, 2)))
    if bodies.joints is None:
        return np.ones(count, bool)
    known: NDArray[np.bool_] = np.logical_and.reduce(np.isfinite(bodies.joints), axis=2)
    return np.asarray(np.logical_or.reduce(known, axis=1))


def _points(truth: FrameBodies, guess: FrameBodies, job: Job) -> Columns:
    """Errors of joints and vertices."""
    found: Columns = {}
    joints = None
    if job.definition is not None:
        joints = paired_joints(truth, guess, job.definition, job.joint_regressors)
        found["mpjpe"] = pve(joints.estimated, joints.true, joints.root, joints.true_root)
        found["pa_mpjpe"] = pa_mpjpe(joints.estimated, joints.true)
        found["mpjpe_world"] = mpjpe(joints.estimated, joints.true, root=None)
    if truth.vertices is not None and guess.vertices is not None and truth.vertices.shape == guess.vertices.shape:
        if joints is not None and job.definition is not None and job.definition.same:
            found["pve"] = pve(guess.vertices, truth.vertices, joints.root, joints.true_root)
        found["pve_world"] = pve(guess.vertices, truth.vertices)
    return found


def _tilt(truth: FrameBodies, guess: FrameBodies, ground: Ground, true_ground: Ground) -> Columns:
    if not {*_PELVIS} <= {*truth.joint_names} & {*guess.joint_names}:
        return {}
    return {"tilt": tilt(_pelvis(guess), _pelvis(truth), ground, true_ground)}


def _pelvis(bodies: FrameBodies) -> NDArray[Any]:
    return np.asarray(bodies.joints)[:, [bodies.joint_names.index(name) for name in _PELVIS]]


def _balance(vertices: NDArray[Any], model: BodyModel, ground: Ground, true: Frames) -> Columns:
    template = model.template
    found: Columns = {
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
        found["bose_released"] = bose(vertices, template, ground, bose_mode="released", labels=labels)
    return found


def _mass(vertices: NDArray[Any], model: BodyModel, true: Frames) -> Columns:
    """Errors of the centre of mass, by each formulation, where it was measured."""
    if true.center_of_mass is None:
        return {}
    found = {"com_error": com_error(ip.center_of_mass(vertices, model.template), true.center_of_mass)}
    for method in _METHODS:
        center = ip.center_of_mass(vertices, model.template, method)
        found[f"com_error_{method}"] = com_error(center, true.center_of_mass)
    return found


def _pressure(vertices: NDArray[Any], model: BodyModel, ground: Ground, true: Frames, preset: str) -> Columns:
    """Where the ground carries the body, against what a mat or force plates measured."""
    if true.center_of_pressure is None:
        return {}
    constants = ip.presets.get(preset)
    if true.pressure is None:
        curve = {"alpha": constants.alpha, "gamma": constants.gamma, "epsilon": constants.epsilon}
        center = ip.center_of_pressure(vertices, model.template, ground, **curve)
        return {"cop_error": cop_error(center, true.center_of_pressure, ground)}
    samples = ip.sample_surface(vertices, model.template)
    found = moyo(samples, ground, true.pressure, true.center_of_pressure, constants.alpha, constants.gamma)
    return {
        "pressure_iou": found.fixed.iou,
        "cop_error": found.fixed.cop_error,
        "pressure_iou_chosen": found.best_iou.iou,
        "cop_error_chosen": found.best_cop_error.cop_error,
    }
