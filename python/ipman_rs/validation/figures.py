"""The figures of a comparison, as plain values in metres, kilograms and newtons; None where there is none."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ipman_rs.gravity import GRAVITY
from ipman_rs.jsonable import jsonable

from .acceleration import CUTOFF
from .comparison import MeasuredComparison, distances
from .computed import METHODS, plate_loads
from .zero_moment_point import along_force

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]

SPREAD = 0.05  # of the weight: more says that not all of it is on the plates
QUICK = ("jump", "running")
APART = 0.03  # of the weight: more is not the same
AXES = ("forward", "left", "up")


def figures(comparison: MeasuredComparison) -> dict[str, Any]:
    """All values that `report` prints of a recording."""
    mass = comparison.computed.mass if comparison.seen is None else comparison.computed.mass[comparison.seen]
    return jsonable(
        {
            "name": comparison.name,
            "kind": comparison.kind,
            "frames": len(comparison.times),
            "rate_hz": comparison.rate,
            "complete_frames": int(comparison.complete.sum()),
            "frames_beside_plates": int(comparison.beside.sum()),
            "mass": {
                "volume_mean": mass.mean(),
                "volume_least": mass.min(),
                "volume_most": mass.max(),
                "plates": comparison.weight,
                "plates_std": _std(comparison.weights),
                "standing": comparison.standing,
            },
            "unloaded_force": comparison.unloaded,
            "force": _force(comparison),
            "com": _against_reference(comparison),
            "standing": _standing(comparison),
            "cop": {phase: _centers(comparison, mask) for phase, mask in comparison.phases.items()}
            if comparison.plates
            else {},
            "shares": _shares(comparison),
            "flags": flags(comparison),
        }
    )


def flags(comparison: MeasuredComparison) -> list[str]:
    """What is odd about the plates: forces that are no numbers, no weight, one that changes, or is not that of standing
    still, a foot beside them, and a force that the movement does not explain."""
    frames, weight, standing = len(comparison.times), comparison.weight, comparison.standing
    notes = [
        f"the forces of plate {plate + 1} are no numbers in {count} of {frames} frames: they are left out"
        for plate, count in enumerate(comparison.lacking.sum(axis=0).tolist())
        if count
    ]
    if comparison.plates is not None:
        notes += _missing_reasons(comparison)
    spread, loaded = _std(comparison.weights), int(comparison.beside.sum() + comparison.complete.sum())
    if comparison.beside.any():
        which = f"{comparison.beside.sum()} of {loaded} loaded frames"
        notes.append(f"a foot is on the floor beside the plates in {which}: they are left out")
    if spread is not None and spread > SPREAD * weight:
        why = "landings are quicker than the low pass" if comparison.kind in QUICK else "is a foot beside the plates?"
        notes.append(
            f"weight by the plates: {weight:.1f} ± {spread:.1f} kg, a spread of {spread / weight:.0%}, "
            f"expected up to {SPREAD:.0%}: {why}"
        )
    if np.isfinite(standing) and np.isfinite(weight) and abs(weight / standing - 1) > APART:
        notes.append(f"weight by the plates: {weight:.1f} kg, but {standing:.1f} kg standing still, which is taken")
    force = _force(comparison)
    if force is not None and comparison.kind != "quiet standing" and force["share"] > force["at_rest"]:
        notes.append(
            f"upward force: {force['share']:.1%} off with the acceleration of the fitted body, {force['at_rest']:.1%} "
            "without: the plates measure not all of it, or not this movement"
        )
    return notes


def _missing_reasons(comparison: MeasuredComparison) -> list[str]:
    """Why there is no acceleration, or no weight by the plates."""
    reasons = []
    if comparison.rate < 4 * CUTOFF:
        reasons.append(
            f"{comparison.rate:.3g} frames a second: accelerations, and with them the ZMP and the weight of who moves, "
            f"need {4 * CUTOFF:g} or more"
        )
    if not np.isfinite(comparison.weight):
        why = "in no frame is all of the weight on the plates"
        if comparison.complete.any():
            why = "the accelerations of the frames on the plates are not known"
        elif not comparison.loaded.any():
            why = "in no frame is a plate loaded and the force of each known"
        reasons.append(f"no weight by the plates: {why}")
    return reasons


def _std(values: Array) -> float | None:
    return float(np.nanstd(values)) if np.isfinite(values).any() else None


def _force(comparison: MeasuredComparison) -> dict[str, Any] | None:
    """The upward force that the fitted body's acceleration asks for, m (g + a), against the plates', N and as a share
    of the weight; `at_rest`: the weight itself against the plates'."""
    if comparison.plates is None:
        return None
    used = comparison.complete & np.isfinite(comparison.acceleration[:, 1])
    if not used.any():
        return None
    weight, upward = comparison.mass * GRAVITY, comparison.force[used, 1]
    off = comparison.mass * (GRAVITY + comparison.acceleration[used, 1]) - upward
    return {
        "rms": _rms(off),
        "share": _rms(off) / weight,
        "at_rest": _rms(weight - upward) / weight,
        "frames": int(used.sum()),
    }


def _against_reference(comparison: MeasuredComparison) -> dict[str, Any] | None:
    """Of each formulation: mean and rms difference forward, left and up of the person, and the mean distance, m."""
    if comparison.reference is None:
        return None
    used = np.isfinite(comparison.reference).all(axis=1)
    used = used if comparison.seen is None else used & comparison.seen
    if not used.any():
        return None
    errors = {}
    for method in METHODS:
        off = comparison.of_person(comparison.computed.com[method] - comparison.reference)[used]
        errors[method] = {
            "mean": off.mean(axis=0),
            "rms": np.sqrt((off**2).mean(axis=0)),
            "worst": np.abs(off).max(axis=0),
            "distance": np.linalg.norm(off, axis=1).mean(),
        }
    seconds = [comparison.times[used][0], comparison.times[used][-1]]
    return {
        "judge": comparison.reference_name,
        "frames": int(used.sum()),
        "seconds": seconds,
        "axes": AXES,
        "methods": errors,
    }


def _standing(comparison: MeasuredComparison) -> dict[str, Any] | None:
    """Quiet standing: the mean of CoM − CoP forward and left, its length, their distance over time, and sways, rms."""
    if comparison.kind != "quiet standing" or comparison.measured is None or not comparison.complete.any():
        return None
    com, cop = (points[comparison.complete][:, [0, 2]] for points in (comparison.com, comparison.measured))
    mean = comparison.of_person(comparison.com - comparison.measured)[comparison.complete, :2].mean(axis=0)
    return {
        "offset": mean,
        "offset_length": np.linalg.norm(mean),
        "distance": np.linalg.norm(com - cop, axis=1).mean(),
        "sway_com": _sway(com),
        "sway_cop": _sway(cop),
    }


def _centers(comparison: MeasuredComparison, mask: Mask) -> dict[str, Any]:
    """Mean distance on the floor, m, from the measured centre of pressure to each computed one, on the same frames."""
    assert comparison.plates is not None
    assert comparison.measured is not None
    mask = mask & np.isfinite(comparison.measured[:, 0])
    moving = np.isfinite(comparison.acceleration[:, 0])
    if moving.any():
        mask = mask & moving
    record: dict[str, Any] = {"frames": int(mask.sum())}
    record["distance"] = {
        name: _mean(distances(points, comparison.measured)[mask]) for name, points in comparison.centers.items()
    }
    if comparison.reference is not None:
        with_reference = mask & np.isfinite(comparison.reference).all(axis=1)
        there: Mapping[str, Array] = {
            "at rest: g(CoM)": comparison.floor.project(comparison.reference),
            "CoM along the force": along_force(comparison.reference, comparison.force, comparison.floor),
        }
        record["reference_frames"] = int(with_reference.sum())
        record["reference"] = {
            name: _mean(distances(points, comparison.measured)[with_reference]) for name, points in there.items()
        }
        record["on_reference_frames"] = {
            name: _mean(distances(comparison.centers[name], comparison.measured)[with_reference]) for name in there
        }
    return record


def _shares(comparison: MeasuredComparison) -> dict[str, Any] | None:
    """The first of two loaded plates' part of the load: measured, by the paper's pressure, and how far they differ."""
    if comparison.plates is None:
        return None
    loads = plate_loads(comparison.plates)
    used = comparison.complete & np.isfinite(comparison.computed.shares)
    if not used.any():
        return None
    first = np.array([row[row > 0][0] / row.sum() for row in loads[used]])
    computed = comparison.computed.shares[used]
    return {
        "frames": int(used.sum()),
        "measured": first.mean(),
        "computed": computed.mean(),
        "difference": np.abs(computed - first).mean(),
    }


def _sway(points: Array) -> float:
    return float(np.sqrt(((points - points.mean(axis=0)) ** 2).sum(axis=1).mean()))


def _rms(values: Array) -> float:
    return float(np.sqrt(np.square(values).mean()))


def _mean(values: Array) -> float | None:
    return float(values.mean()) if len(values) else None
