"""The types of the options, and options that commands share. Light: `ipman --help` loads this."""

from __future__ import annotations

import math
import os

import click

# Kept equal to `ipman_rs.presets.PRESETS` by a test.
PRESETS = ("paper-r", "paper-o", "released", "balanced")

_AXES = {"x": (1.0, 0.0, 0.0), "y": (0.0, 1.0, 0.0), "z": (0.0, 0.0, 1.0)}


class UpAxis(click.ParamType):
    name = "axis"

    def convert(self, value, param, ctx):
        """A unit axis or a normal as three numbers."""
        if isinstance(value, tuple):
            return value
        text = value.strip().lower()
        if text.lstrip("+-") in _AXES and len(text) <= 2:
            sign = -1.0 if text.startswith("-") else 1.0
            return tuple(sign * x for x in _AXES[text.lstrip("+-")])
        try:
            normal = tuple(float(x) for x in text.split(","))
        except ValueError:
            normal = ()
        if len(normal) != 3 or not all(map(math.isfinite, normal)) or not any(normal):
            self.fail(f"{value!r} is neither one of x, y, z, -x, -y, -z nor a normal such as 0,0,1", param, ctx)
        return normal


class GroundHeight(click.ParamType):
    name = "height"

    def __init__(self, word: str) -> None:
        self.word = word

    def convert(self, value, param, ctx):
        """Metres, or None for the word."""
        if value is None or isinstance(value, float):
            return value
        if value.strip().lower() == self.word:
            return None
        try:
            height = float(value)
        except ValueError:
            height = math.nan
        if not math.isfinite(height):
            self.fail(f"{value!r} is neither a height in metres nor {self.word}", param, ctx)
        return height


class ImageSize(click.ParamType):
    name = "size"

    def convert(self, value, param, ctx):
        """Width and height in pixels."""
        if isinstance(value, tuple):
            return value
        try:
            width, height = (float(side) for side in value.lower().split("x"))
        except ValueError:
            width = height = math.nan
        if not (0 < width < math.inf and 0 < height < math.inf):
            self.fail(f"{value!r} is no width and height in pixels such as 1920x1080", param, ctx)
        return width, height


class Times(click.ParamType):
    name = "seconds"

    def convert(self, value, param, ctx):
        """Ascending seconds."""
        if isinstance(value, tuple):
            return value
        try:
            times = tuple(float(word) for word in value.split(","))
        except ValueError:
            times = ()
        if not times or not all(0 <= time < math.inf for time in times) or list(times) != sorted(times):
            self.fail(f"{value!r} is no ascending list of seconds such as 0.41667,2", param, ctx)
        return times


class Setting(click.ParamType):
    name = "name=value"

    def convert(self, value, param, ctx):
        """A name and a word or number."""
        if isinstance(value, tuple):
            return value
        name, equals, word = value.partition("=")
        if not name or not equals:
            self.fail(f"{value!r} is no option such as frame=camera", param, ctx)
        for number in (int, float):
            try:
                return name, number(word)
            except ValueError:
                continue
        return name, word


TIMES = Times()
UP, GROUND, FLOOR, SIZE = UpAxis(), GroundHeight("auto"), GroundHeight("found"), ImageSize()


def several_processes(command):
    """The option of commands that work in several processes."""
    return click.option(
        "-j", "--workers", type=click.IntRange(1), default=_cores, show_default="one a processor core",
        help="Processes.",
    )(command)  # fmt: skip


def _cores() -> int:
    """The processor cores that this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def of_unknown_camera(command):
    """The options of commands that assume a camera for an image."""
    pitch = click.option(
        "--camera-pitch", "pitch", type=float, default=0.0, show_default=True, metavar="DEGREES",
        help="How far the camera looks down; negative: up.",
    )  # fmt: skip
    diagonal = "Focal length in pixels. Default: the image's diagonal."
    return click.option("--focal", type=float, metavar="PX", help=diagonal)(pitch(command))
