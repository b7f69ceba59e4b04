"""How sure a body is that was fitted to a photo: green, amber or red, and why, in words.

red     what is wrong can be measured: the points are missed, the body falls
amber   what was guessed matters: a support, limbs that were not seen, another body that explains the image as well
green   neither
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import torch

import ipman_rs as ip

from ..body.landmarks import SIDES
from .candidate import Candidate
from .hypotheses import Hypothesis
from .support_points import NAMES, SOLES, flat_heights, support_points
from .terms.bone_directions import BONES

POOR = 5.0  # % of the person's height: a median error above it is flagged
CLOSE = 100.0  # cost: hypotheses that differ by less explain the image alike
APART = 0.08  # m: mean distance of the joints from which two bodies are different ones
TURNED = 60.0  # degrees between a bone and its detected direction
UNSEEN = 0.5  # visibility under which a limb's end counts as not seen
CONTACT = 0.03  # m above the floor: what stands on it, in the margin
RAISED = 0.02  # m: a sole that is down and higher than this is told
TILTED = 15.0  # degrees

IN_WORDS = {"feet": "on its feet", "seat": "on a seat", "floor": "on the floor", "nothing": "moving"}
_LIMBS = {"arm": ("elbow", "wrist"), "leg": ("knee", "ankle")}


@dataclass(frozen=True)
class Confidence:
    """level: green, amber or red. reasons: why not green. measures: plain values for JSON."""

    level: str
    reasons: list[str]
    measures: dict[str, Any]

    def record(self) -> dict[str, Any]:
        return {"level": self.level, "reasons": self.reasons, **self.measures}


def assess(
    candidate: Candidate,
    error_percent: float,
    weighed: Sequence[Hypothesis] | None = None,
    runner_up: Candidate | None = None,
) -> Confidence:
    """The confidence in one fitted body, a candidate of one row.

    error_percent: the median reprojection error, in percent of the body's height in the image. weighed: its hypotheses,
    the cheapest first; runner_up: the body of the second.
    """
    red: list[str] = []
    amber: list[str] = []
    measures: dict[str, Any] = {}
    if not error_percent <= POOR:
        red.append(f"fits poorly: median error {error_percent:.1f} % of the person's height")
    unseen = unseen_limbs(candidate)
    if unseen:
        amber.append(f"not seen, and guessed: {', '.join(unseen)}")
    turned = turned_bones(candidate)
    if turned:
        amber.append(f"points elsewhere than the detector saw it: {', '.join(turned)}")
    if weighed and candidate.problem.ground is not None:
        _assess_support(candidate, weighed, red, amber, measures)
        _assess_runner_up(candidate, weighed, runner_up, amber, measures)
    level = "red" if red else "amber" if amber else "green"
    return Confidence(level, [*red, *amber], {**measures, "unseen": unseen, "turned": turned})


def _assess_support(
    candidate: Candidate,
    weighed: Sequence[Hypothesis],
    red: list[str],
    amber: list[str],
    measures: dict[str, Any],
) -> None:
    """What holds the body up, whether it does, and how the camera looks down."""
    chosen = weighed[0]
    measures |= {"support": chosen.support, "physics": chosen.support != "nothing"}
    if not math.isnan(chosen.pitch):
        measures |= {"camera_pitch": chosen.pitch, "camera_pitch_range": _pitch_range(weighed)}
    if chosen.support == "nothing":
        amber.append("balance and floor were not asked for: it moves, or something unseen holds it")
        return
    soles = measure_soles(candidate)
    measures["soles"] = soles
    for side, sole in soles.items() if chosen.support != "floor" else ():
        if sole["down"] and sole["height_mm"] > 1000 * RAISED:
            amber.append(f"the {side} foot is {sole['height_mm']:.0f} mm off the floor")
        elif sole["down"] and abs(sole["tilt_degrees"]) > TILTED:
            what = "on its toes" if sole["tilt_degrees"] > 0 else "on its heel"
            amber.append(f"the {side} foot stands {what}")
    if chosen.support == "seat":
        amber.append("it sits on something that is not seen in the points: the seat is assumed")
        return
    ground = candidate.problem.ground
    assert ground is not None
    with torch.no_grad():
        vertices = candidate.vertices.double().numpy()[0]
    plane = ip.Ground(ground.normal.reshape(-1, 3)[0].numpy(), float(ground.height.reshape(-1)[0]))
    margin = float(ip.support_margin(vertices, candidate.problem.body.body.template, plane, threshold=CONTACT))
    measures["margin_mm"] = 1000 * margin if math.isfinite(margin) else None
    if not margin > 0:
        outside = f"its centre of mass is {-1000 * margin:.0f} mm outside what it stands on"
        red.append(outside if math.isfinite(margin) else "nothing of it touches the floor")


def _assess_runner_up(
    candidate: Candidate,
    weighed: Sequence[Hypothesis],
    runner_up: Candidate | None,
    amber: list[str],
    measures: dict[str, Any],
) -> None:
    """Whether another body explains the image nearly as well."""
    if runner_up is None or len(weighed) < 2:
        return
    second, dearer = weighed[1], weighed[1].cost - weighed[0].cost
    with torch.no_grad():
        places = [(body.posed.joints - body.posed.joints[:, :1]).double() for body in (candidate, runner_up)]
    apart = float((places[0] - places[1]).norm(dim=-1).mean())
    measures["runner_up"] = {
        "support": second.support,
        "camera_pitch": None if math.isnan(second.pitch) else second.pitch,
        "dearer": dearer if math.isfinite(dearer) else None,
        "joints_apart_mm": 1000 * apart,
    }
    if dearer < CLOSE and apart > APART:
        other = {"feet": "on its feet", "seat": "on a seat", "floor": "on the floor", "nothing": "moving"}[
            second.support
        ]
        seen = "" if math.isnan(second.pitch) else f", seen from {second.pitch:.0f}°"
        amber.append(f"another body explains the image nearly as well ({other}{seen})")


def _pitch_range(weighed: Sequence[Hypothesis]) -> list[float]:
    """The least and the largest pitch with the chosen support that explain the image alike."""
    chosen = weighed[0]
    near = [each.pitch for each in weighed if each.support == chosen.support and each.cost < chosen.cost + CLOSE]
    return [min(near), max(near)]


def measure_soles(candidate: Candidate) -> dict[str, dict[str, Any]]:
    """Of each foot: whether it is down, the height of its lowest point (mm), and its tilt, heel up + (degrees)."""
    problem = candidate.problem
    body, ground = problem.body.body, problem.ground
    assert ground is not None
    normal, level = ground.normal.reshape(-1, 3)[0].double(), ground.height.reshape(-1)[0].double()
    with torch.no_grad():
        points = candidate.points_of(support_points(problem.body))[0, [NAMES.index(name) for name in SOLES]]
        heights = candidate.vertices.double()[0] @ normal - level
    raised = points @ normal - flat_heights(body)
    owner = np.array(body.joint_names)[body.weights.argmax(axis=1)]
    soles = {}
    for number, side in enumerate(SIDES):
        foot = torch.from_numpy(np.isin(owner, (f"{side}_ankle", f"{side}_foot")))
        heel, toe = (SOLES.index(f"{side}_{point}") for point in ("heel", "big_toe"))
        long = float((points[heel] - points[toe]).norm())
        soles[side] = {
            "down": problem.feet_down is None or bool(problem.feet_down[0, number]),
            "height_mm": 1000 * float(heights[foot].min()),
            "tilt_degrees": math.degrees(math.atan2(float(raised[heel] - raised[toe]), long)),
        }
    return soles


def unseen_limbs(candidate: Candidate) -> list[str]:
    """The arms and legs of which a joint was not seen."""
    problem = candidate.problem
    if problem.confidence is None:
        return []
    seen = dict(zip(problem.landmarks.names, problem.confidence[0].tolist(), strict=True))
    return [
        f"{side} {limb}"
        for side in SIDES
        for limb, joints in _LIMBS.items()
        if min(seen.get(f"{side}_{joint}", 0.0) for joint in joints) < UNSEEN
    ]


def turned_bones(candidate: Candidate) -> list[str]:
    """The bones of limbs that point far from where a detector of 3D points saw them point, and was sure."""
    problem = candidate.problem
    if problem.relative_points is None or problem.relative_confidence is None:
        return []
    names = problem.landmarks.names
    with torch.no_grad():
        points = candidate.camera.turn(candidate.landmarks[:, None])[0, 0]
    turned = []
    for start, end in BONES:
        if start not in names or end not in names or "ear" in start or "heel" in start:
            continue
        a, b = names.index(start), names.index(end)
        if float(problem.relative_confidence[0, [a, b]].min()) < UNSEEN:
            continue
        bone, other = points[b] - points[a], problem.relative_points[0, b] - problem.relative_points[0, a]
        cosine = float(bone @ other / (bone.norm() * other.norm()).clamp(min=1e-9))
        if cosine < math.cos(math.radians(TURNED)):
            turned.append(f"{start.replace('_', ' ')} to {end.replace('_', ' ')}")
    return turned
