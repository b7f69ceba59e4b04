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


def figures(one: MeasuredComparison) -> dict[str, Any]:
    """All that `report` prints of a recording."""
    mass = one.computed.mass if one.seen is None else one.computed.mass[one.seen]
    return jsonable(
        {
            "name": one.name,
            "kind": one.kind,
            "frames": len(one.times),
            "rate_hz": one.rate,
            "complete_frames": int(one.complete.sum()),
            "frames_beside_plates": int(one.beside.sum()),
            "mass": {
                "volume_mean": mass.mean(),
                "volume_least": mass.min(),
                "volume_most": mass.max(),
                "plates": one.weight,
                "plates_std": _std(one.weights),
                "standing": one.standing,
            },
            "unloaded_force": one.unloaded,
            "force": _force(one),
            "com": _against_reference(one),
            "standing": _standing(one),
            "cop": {phase: _centers(one, mask) for phase, mask in one.phases.items()} if one.plates else {},
            "shares": _shares(one),
            "flags": flags(one),
        }
    )


def flags(one: MeasuredComparison) -> list[str]:
    """What is odd about the plates: forces that are no numbers, no weight, one that changes, or is not that of standing
    still, a foot beside them, and a force that the movement does not explain."""
    said = [
        f"the forces of plate {plate + 1} are no numbers in {count} of {len(one.times)} frames: they are left out"
        for plate, count in enumerate(one.lacking.sum(axis=0).tolist())
        if count
    ]
    if one.plates is not None:
        said += _missing_reasons(one)
    spread, loaded = _std(one.weights), int(one.beside.sum() + one.complete.sum())
    if one.beside.any():
        which = f"{one.beside.sum()} of {loaded} loaded frames"
        said.append(f"a foot is on the floor beside the plates in {which}: they are left out")
    if spread is not None and spread > SPREAD * one.weight:
        why = "landings are quicker than the low pass" if one.kind in QUICK else "is a foot beside the plates?"
        said.append(
            f"weight by the plates: {one.weight:.1f} ± {spread:.1f} kg, a spread of {spread / one.weight:.0%}, "
            f"expected up to {SPREAD:.0%}: {why}"
        )
    if np.isfinite(one.standing) and np.isfinite(one.weight) and abs(one.weight / one.standing - 1) > APART:
        said.append(
            f"weight by the plates: {one.weight:.1f} kg, but {one.standing:.1f} kg standing still, which is taken"
        )
    force = _force(one)
    if force is not None and one.kind != "quiet standing" and force["share"] > force["at_rest"]:
        said.append(
            f"upward force: {force['share']:.1%} off with the acceleration of the fitted body, {force['at_rest']:.1%} "
            "without: the plates measure not all of it, or not this movement"
        )
    return said


def _missing_reasons(one: MeasuredComparison) -> list[str]:
    """Why there is no acceleration, or no weight by the plates."""
    said = []
    if one.rate < 4 * CUTOFF:
        said.append(
            f"{one.rate:.3g} frames a second: accelerations, and with them the ZMP and the weight of who moves, "
            f"need {4 * CUTOFF:g} or more"
        )
    if not np.isfinite(one.weight):
        why = "in no frame is all of the weight on the plates"
        if one.complete.any():
            why = "the accelerations of the frames on the plates are not known"
        elif not one.loaded.any():
            why = "in no frame is a plate loaded and the force of each known"
        said.append(f"no weight by the plates: {why}")
    return said


def _std(values: Array) -> float | None:
    return float(np.nanstd(values)) if np.isfinite(values).any() else None


def _force(one: MeasuredComparison) -> dict[str, Any] | None:
    """The upward force that the fitted body's acceleration asks for, m (g + a), against the plates', N and as a share
    of the weight; `at_rest`: the weight itself against the plates'."""
    if one.plates is None:
        return None
    used = one.complete & np.isfinite(one.acceleration[:, 1])
    if not used.any():
        return None
    weight, upward = one.mass * GRAVITY, one.force[used, 1]
    off = one.mass * (GRAVITY + one.acceleration[used, 1]) - upward
    return {
        "rms": _rms(off),
        "share": _rms(off) / weight,
        "at_rest": _rms(weight - upward) / weight,
        "frames": int(used.sum()),
    }


def _against_reference(one: MeasuredComparison) -> dict[str, Any] | None:
    """Of each formulation: mean and rms difference forward, left and up of the person, and the mean distance, m."""
    if one.reference is None:
        return None
    used = np.isfinite(one.reference).all(axis=1)
    used = used if one.seen is None else used & one.seen
    if not used.any():
        return None
    found = {}
    for method in METHODS:
        off = one.of_person(one.computed.com[method] - one.reference)[used]
        found[method] = {
            "mean": off.mean(axis=0),
            "rms": np.sqrt((off**2).mean(axis=0)),
            "worst": np.abs(off).max(axis=0),
            "distance": np.linalg.norm(off, axis=1).mean(),
        }
    seconds = [one.times[used][0], one.times[used][-1]]
    return {"judge": one.judge, "frames": int(used.sum()), "seconds": seconds, "axes": AXES, "methods": found}


def _standing(one: MeasuredComparison) -> dict[str, Any] | None:
    """Quiet standing: the mean of CoM − CoP forward and left, its length, their distance over time, and sways, rms."""
    if one.kind != "quiet standing" or one.measured is None or not one.complete.any():
        return None
    com, cop = (points[one.complete][:, [0, 2]] for points in (one.com, one.measured))
    mean = one.of_person(one.com - one.measured)[one.complete, :2].mean(axis=0)
    return {
        "offset": mean,
        "offset_length": np.linalg.norm(mean),
        "distance": np.linalg.norm(com - cop, axis=1).mean(),
        "sway_com": _sway(com),
        "sway_cop": _sway(cop),
    }


def _centers(one: MeasuredComparison, mask: Mask) -> dict[str, Any]:
    """Mean distance on the floor, m, from the measured centre of pressure to each computed one, on the same frames."""
    assert one.plates is not None
    assert one.measured is not None
    mask = mask & np.isfinite(one.measured[:, 0])
    moving = np.isfinite(one.acceleration[:, 0])
    if moving.any():
        mask = mask & moving
    found: dict[str, Any] = {"frames": int(mask.sum())}
    found["distance"] = {name: _mean(distances(points, one.measured)[mask]) for name, points in one.centers.items()}
    if one.reference is not None:
        known = mask & np.isfinite(one.reference).all(axis=1)
        there: Mapping[str, Array] = {
            "at rest: g(CoM)": one.floor.project(one.reference),
            "CoM along the force": along_force(one.reference, one.force, one.floor),
        }
        found["reference_frames"] = int(known.sum())
        found["reference"] = {name: _mean(distances(points, one.measured)[known]) for name, points in there.items()}
        found["on_reference_frames"] = {
            name: _mean(distances(one.centers[name], one.measured)[known]) for name in there
        }
    return found


def _shares(one: MeasuredComparison) -> dict[str, Any] | None:
    """The first of two loaded plates' part of the load: measured, by the paper's pressure, and how far they differ."""
    if one.plates is None:
        return None
    loads = plate_loads(one.plates)
    used = one.complete & np.isfinite(one.computed.shares)
    if not used.any():
        return None
    first = np.array([row[row > 0][0] / row.sum() for row in loads[used]])
    computed = one.computed.shares[used]
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
