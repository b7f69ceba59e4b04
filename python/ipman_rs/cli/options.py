"""The types of the options, and options that commands share. Light: `ipman --help` loads this."""

from __future__ import annotations

import importlib.util
import math
import os

import click

# Kept equal to `ipman_rs.presets.PRESETS` by a test.
PRESETS = ("paper-r", "paper-o", "released", "balanced")

METRES = {"m": 1.0, "dm": 0.1, "cm": 0.01, "mm": 0.001, "km": 1000.0, "in": 0.0254, "ft": 0.3048, "yd": 0.9144}
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


class Unit(click.ParamType):
    name = "unit"

    def convert(self, value, param, ctx):
        """Metres in one of it."""
        if isinstance(value, float):
            return value
        word = value.strip().lower()
        if word in METRES:
            return METRES[word]
        metres = _number(word)
        if not 0 < metres < math.inf:
            self.fail(f"{value!r} is none of {', '.join(METRES)}, and no number of metres such as 0.001", param, ctx)
        return metres


class Rate(click.ParamType):
    name = "hz"

    def convert(self, value, param, ctx):
        """Frames a second."""
        hertz = _number(value)
        if not 0 < hertz < math.inf:
            self.fail(f"{value!r} is no number of frames a second above 0", param, ctx)
        return hertz


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
        height = _number(value)
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


def _number(text: str) -> float:
    """NaN for what is none."""
    try:
        return float(text)
    except ValueError:
        return math.nan


TIMES = Times()
UNIT, RATE = Unit(), Rate()
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


# What mends a file that the judge of all doors (`ipman_rs.data.judge`) refuses, beside --up.
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
        "--camera-pitch", "pitch", type=float, default=0.0, show_default=True, metavar="DEGREES",
        help="How far the camera looks down; negative: up.",
    )  # fmt: skip
    diagonal = "Focal length in pixels. Default: the image's diagonal."
    return click.option("--focal", type=float, metavar="PX", help=diagonal)(pitch(command))


def needs(*modules: str) -> None:
    """Ends the command where a module of the extra `fit` is missing."""
    missing = [name for name in modules if importlib.util.find_spec(name) is None]
    if missing:
        raise click.ClickException(f"fitting needs {', '.join(missing)}: pip install 'ipman_rs[fit]'")
