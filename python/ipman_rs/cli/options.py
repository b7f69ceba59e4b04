"""The types of the options, and options that commands share. Light: `ipman --help` loads this."""

from __future__ import annotations

import functools
import importlib.util
import os
from collections.abc import Callable
from typing import Any

import click

from .. import presets, spellings
from ..spellings import METRES

RESUMES = "ipman.resumes"  # in the meta of a context


class Spelled(click.ParamType):
    """What `ipman_rs.spellings` reads; `kind`: of a default that is read already."""

    def __init__(self, read: Callable[[str], Any], kind: type, name: str = "text") -> None:
        self._read, self._kind, self.name = read, kind, name

    def convert(self, value, param, ctx):
        if value is None or isinstance(value, self._kind):
            return value
        try:
            return self._read(value)
        except ValueError as error:
            self.fail(str(error), param, ctx)


UP, SIZE, TIMES = (Spelled(read, tuple) for read in (spellings.axis, spellings.image_size, spellings.times))
SETTING, SHARD = Spelled(spellings.setting, tuple, "name=value"), Spelled(spellings.shard, tuple, "i/n")
UNIT, RATE = Spelled(spellings.unit, float), Spelled(spellings.rate, float)
GROUND, FLOOR = (Spelled(spellings.height_or(word), float) for word in ("auto", "found"))
PRESET = click.Choice(tuple(presets.PRESETS))
preset = click.option("--preset", type=PRESET, default="paper-r", show_default=True, help="Constants of the formulas.")


def resumes(command: Callable[..., Any]) -> Callable[..., Any]:
    """A command that goes on where it was, when it is run again: it says so where it is interrupted."""

    @functools.wraps(command)
    def run(*words: Any, **options: Any) -> Any:
        click.get_current_context().meta[RESUMES] = True
        return command(*words, **options)

    return run


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
