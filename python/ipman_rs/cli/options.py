"""The types of the options, and options that commands share. Light: `ipman --help` loads this."""

from __future__ import annotations

import importlib.util
import math
import os
from collections.abc import Callable
from typing import Any

import click

# Kept equal to `ipman_rs.presets.PRESETS` by a test.
PRESETS = ("paper-r", "paper-o", "released", "balanced")

METRES = {"m": 1.0, "dm": 0.1, "cm": 0.01, "mm": 0.001, "km": 1000.0, "in": 0.0254, "ft": 0.3048, "yd": 0.9144}
_AXES = {"x": (1.0, 0.0, 0.0), "y": (0.0, 1.0, 0.0), "z": (0.0, 0.0, 1.0)}


class Parsed(click.ParamType):
    """A word of the command line, read by a function that raises ValueError with what is wrong; `kind`: of a default
    that is read already."""

    def __init__(self, name: str, read: Callable[[str], Any], kind: type) -> None:
        self.name, self._read, self._kind = name, read, kind

    def convert(self, value, param, ctx):
        if value is None or isinstance(value, self._kind):
            return value
        try:
            return self._read(value)
        except ValueError as error:
            self.fail(str(error), param, ctx)


def _up(text: str) -> tuple[float, ...]:
    """A unit axis or a normal as three numbers."""
    word = text.strip().lower()
    if word.lstrip("+-") in _AXES and len(word) <= 2:
        sign = -1.0 if word.startswith("-") else 1.0
        return tuple(sign * x for x in _AXES[word.lstrip("+-")])
    normal = tuple(map(_number, word.split(",")))
    if len(normal) != 3 or not all(map(math.isfinite, normal)) or not any(normal):
        raise ValueError(f"{text!r} is neither one of x, y, z, -x, -y, -z nor a normal such as 0,0,1")
    return normal


def _unit(text: str) -> float:
    """Metres in one of it."""
    word = text.strip().lower()
    metres = METRES.get(word, _number(word))
    if not 0 < metres < math.inf:
        raise ValueError(f"{text!r} is none of {', '.join(METRES)}, and no number of metres such as 0.001")
    return metres


def _rate(text: str) -> float:
    """Frames a second."""
    hertz = _number(text)
    if not 0 < hertz < math.inf:
        raise ValueError(f"{text!r} is no number of frames a second above 0")
    return hertz


def _height_or(word: str) -> Callable[[str], float | None]:
    """Metres, or None for the word."""

    def read(text: str) -> float | None:
        height = _number(text)
        if text.strip().lower() == word:
            return None
        if not math.isfinite(height):
            raise ValueError(f"{text!r} is neither a height in metres nor {word}")
        return height

    return read


def _size(text: str) -> tuple[float, ...]:
    """Width and height in pixels."""
    sides = tuple(map(_number, text.lower().split("x")))
    if len(sides) != 2 or not all(0 < side < math.inf for side in sides):
        raise ValueError(f"{text!r} is no width and height in pixels such as 1920x1080")
    return sides


def _times(text: str) -> tuple[float, ...]:
    """Ascending seconds."""
    times = tuple(map(_number, text.split(",")))
    if not all(0 <= time < math.inf for time in times) or list(times) != sorted(times):
        raise ValueError(f"{text!r} is no ascending list of seconds such as 0.41667,2")
    return times


def _setting(text: str) -> tuple[str, str | int | float]:
    """A name and a word or number."""
    name, equals, word = text.partition("=")
    if not name or not equals:
        raise ValueError(f"{text!r} is no option such as frame=camera")
    for number in (int, float):
        try:
            return name, number(word)
        except ValueError:
            continue
    return name, word


def _shard(text: str) -> tuple[int, ...]:
    """Number and count, from 1."""
    words = text.split("/")
    if len(words) != 2 or not all(word.isdecimal() for word in words) or not 1 <= int(words[0]) <= int(words[1]):
        raise ValueError(f"{text!r} is no shard such as 2/7, the second of seven")
    return tuple(map(int, words))


def _number(text: str) -> float:
    """NaN for what is none."""
    try:
        return float(text)
    except ValueError:
        return math.nan


UP, SIZE, TIMES = Parsed("axis", _up, tuple), Parsed("size", _size, tuple), Parsed("seconds", _times, tuple)
SETTING, SHARD = Parsed("name=value", _setting, tuple), Parsed("i/n", _shard, tuple)
UNIT, RATE = Parsed("unit", _unit, float), Parsed("hz", _rate, float)
GROUND, FLOOR = (Parsed("height", _height_or(word), float) for word in ("auto", "found"))


def several_processes(command):
    """The option of commands that work in several processes."""
    return click.option(
        "-j", "--workers", type=click.IntRange(1), default=_cores, show_default="one a processor core",
        help="Processes.",
    )(command)  # fmt: skip


def _cores() -> int:
    """The processor cores that this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


# What mends a file that `ipman_rs.data.plausibility` refuses, beside --up.
units = click.option(
    "--units", type=UNIT, default="m", show_default=True, metavar="UNIT",
    help=f"Unit of the lengths in the files: {', '.join(METRES)}, or a number of metres.",
)  # fmt: skip
degrees = click.option("--degrees", is_flag=True, help="Rotations in the files are degrees, not radians.")
rate = click.option(
    "--rate", type=RATE, metavar="HZ", help="Frames a second, where a file does not say so or is wrong."
)
force = click.option(
    "--force", is_flag=True, help="Take what cannot be a person, too; what is odd about it is said all the same."
)
subject = click.option(
    "--subject", metavar="NAME", help="Whose markers (NAME:LASI), where a marker file has several people's."
)


def of_files(command):
    """The options of commands that read other people's files: what mends a file that is refused, and --force."""
    return units(degrees(rate(force(command))))


def of_unknown_camera(command):
    """The options of commands that assume a camera for an image."""
    pitch = click.option(
        "--camera-pitch", "pitch", type=float, metavar="DEGREES",
        help="How far the camera looks down; negative: up. Default: found by `fit` where its preset does, else 0.",
    )  # fmt: skip
    diagonal = "Focal length in pixels. Default: the image's diagonal."
    return click.option("--focal", type=float, metavar="PX", help=diagonal)(pitch(command))


def needs(*modules: str) -> None:
    """Ends the command where a module of the extra `fit` is missing."""
    missing = [name for name in modules if importlib.util.find_spec(name) is None]
    if missing:
        raise click.ClickException(f"fitting needs {', '.join(missing)}: pip install 'ipman_rs[fit]'")
