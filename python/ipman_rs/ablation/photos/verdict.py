"""A fitted body beside what a person sees: which of the labels it meets."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from .labels import Label

UPRIGHT = ("stand", "walk", "lunge", "squat", "one-leg")  # postures that feet hold up
ON_FLOOR = 0.02  # m: a sole this near the floor is on it
LEAN = 15.0  # degrees between the trunk and the label, direction included
PITCH = 10.0  # degrees, and what rounding adds
ROUNDING = 1e-6


@dataclass(frozen=True)
class Measures:
    """Of a fitted body: margin of its CoM at 3 cm (m), height of the lowest point of each foot (m), the trunk's
    direction (forward, left, up), the camera's pitch (degrees), the median 2D error (% of its height), and its
    confidence (green, amber, red) with the reasons. support: feet, seat, nothing; empty where nothing was weighed."""

    margin: float
    soles: tuple[float, float]
    trunk: tuple[float, float, float]
    pitch: float
    error: float
    level: str
    support: str
    reasons: tuple[str, ...]


def trunk_direction(joints: dict[str, NDArray[np.float64]], up: NDArray[np.float64]) -> tuple[float, float, float]:
    """Where the trunk points, from the middle of the hips to the neck: forward, left and up, of the person."""
    trunk = joints["neck"] - (joints["left_hip"] + joints["right_hip"]) / 2
    trunk = trunk / np.linalg.norm(trunk)
    left = joints["left_hip"] - joints["right_hip"] + joints["left_shoulder"] - joints["right_shoulder"]
    left = left - (left @ up) * up
    left = left / np.linalg.norm(left)
    forward = np.cross(left, up)
    return float(trunk @ forward), float(trunk @ left), float(trunk @ up)


def judge(label: Label, measures: Measures | None) -> dict[str, bool | None]:
    """Whether each label is met, None where there is nothing to judge; nothing is met without a body."""
    upright = label.posture in UPRIGHT and label.balanced is not False
    asked = {
        "CoM over support": upright,
        "soles": upright and label.feet is not None and any(label.feet),
        "lean": upright and label.lean is not None,
        "pitch": label.pitch is not None,
        "not pulled down": label.posture == "airborne" or label.balanced is False,
    }
    if measures is None:
        return {name: False if wanted else None for name, wanted in asked.items()}
    feet = label.feet or (False, False)
    met = {
        "CoM over support": measures.margin > 0,
        "soles": all(abs(sole) < ON_FLOOR for sole, down in zip(measures.soles, feet, strict=True) if down),
        "lean": label.lean is not None and _angle(measures.trunk, label.lean) <= LEAN,
        "pitch": label.pitch is not None and abs(measures.pitch - label.pitch) <= PITCH + ROUNDING,
        "not pulled down": measures.support == "nothing",
    }
    return {name: bool(met[name]) if wanted else None for name, wanted in asked.items()}


def _angle(a: tuple[float, ...], b: tuple[float, ...]) -> float:
    """Degrees between two directions."""
    return math.degrees(math.acos(min(1.0, max(-1.0, float(np.dot(a, b))))))
