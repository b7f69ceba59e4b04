"""What a person sees in photos: `labels.csv` beside them, one line each.

    file, posture, trunk_lean_deg, lean_direction, feet_on_floor, camera_pitch_deg, balanced

posture: stand, walk, lunge, squat, one-leg, sit-chair, airborne or another word. lean_direction: forward, back, left,
right (the person's own) or none. feet_on_floor: both, left, right, none, or unknown, and what else is said of them.
balanced: yes, no or unknown. Other columns are left alone; an empty cell is unknown.
"""

from __future__ import annotations

import csv
import io
import math
from dataclasses import dataclass
from pathlib import Path

NAME = "labels.csv"
DIRECTIONS = {"forward": (1.0, 0.0), "back": (-1.0, 0.0), "left": (0.0, 1.0), "right": (0.0, -1.0), "none": (0.0, 0.0)}
NEEDED = ("file", "posture")


@dataclass(frozen=True)
class Label:
    """lean: forward, left and up parts of the trunk's direction, length 1. feet: whether the left and the right one are
    on the floor. pitch: degrees, looking down +. None: unknown."""

    file: str
    posture: str
    lean: tuple[float, float, float] | None
    feet: tuple[bool, bool] | None
    pitch: float | None
    balanced: bool | None


def read_labels(folder: Path) -> list[Label]:
    """The labels of a folder. Raises ValueError, with the line, for what cannot be read, and OSError."""
    path = folder / NAME
    if not path.is_file():
        raise ValueError(f"{path}: expected the photos' labels, a CSV file with {', '.join(NEEDED)} …; there is none")
    rows = csv.DictReader(io.StringIO(path.read_text(encoding="utf-8-sig")))
    missing = [name for name in NEEDED if name not in (rows.fieldnames or ())]
    if missing:
        raise ValueError(f"{path}: expected the columns {', '.join(NEEDED)}, got {', '.join(rows.fieldnames or ())}")
    labels = []
    for number, row in enumerate(rows, 2):
        try:
            labels.append(_label({name: (value or "").strip() for name, value in row.items() if name}))
        except ValueError as error:
            raise ValueError(f"{path}: line {number}: {error}") from None
    if not labels:
        raise ValueError(f"{path}: expected a line for each photo, got none")
    return labels


def _label(row: dict[str, str]) -> Label:
    balanced = {"yes": True, "no": False}.get(row.get("balanced", "").lower())
    pitch = _number(row, "camera_pitch_deg")
    return Label(row["file"], row["posture"].lower(), _lean(row), _feet(row.get("feet_on_floor", "")), pitch, balanced)


def _lean(row: dict[str, str]) -> tuple[float, float, float] | None:
    degrees, word = _number(row, "trunk_lean_deg"), row.get("lean_direction", "").lower()
    if degrees is None or word not in DIRECTIONS:
        return None
    forward, left = DIRECTIONS[word]
    sine = math.sin(math.radians(degrees))
    return forward * sine, left * sine, math.sqrt(1 - sine**2 * (forward**2 + left**2))


def _feet(text: str) -> tuple[bool, bool] | None:
    word = text.lower().split()[0] if text.split() else ""
    known = {"both": (True, True), "left": (True, False), "right": (False, True), "none": (False, False)}
    return None if "one or" in text.lower() else known.get(word)


def _number(row: dict[str, str], name: str) -> float | None:
    text = row.get(name, "")
    if text in ("", "unknown"):
        return None
    try:
        number = float(text)
    except ValueError:
        raise ValueError(f"{name}: expected degrees, got {text!r}") from None
    if not abs(number) <= 180:
        raise ValueError(f"{name}: expected degrees from -180 to 180, got {text}")
    return number
