"""Files of bodies, let go, and compared: what `ipman simulate` does."""

from __future__ import annotations

import json
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from .. import spellings
from ..files import path_list
from ..files.errors import FileError
from ..files.names import Paths
from ..progress import Progress, silent
from ..study.from_file import Request
from . import MethodComparison, Simulation
from .comparison_report import (
    compare_falls,
    comparison_lines,
    comparison_record,
    comparison_table,
    pairs,
    write_comparison,
)
from .fall import checked_options
from .inputs import GroundedBodies, read_bodies
from .report import Fall, run_falls, write_falls

AS_IT_IS = Request()
OPTIONS = {
    "engine": "rapier", "shape": "hull", "times": (0.41667, 2.0), "step": 1 / 240, "friction": 1.0, "snap": True,
    "tip_only": False,
}  # fmt: skip


@dataclass
class Falls:
    """The falls of each file that could be read; `failures`: of the others; `flags`: what is odd about the bodies of
    each file that was read."""

    falls: list[Fall] = field(default_factory=list)
    failures: list[FileError] = field(default_factory=list)
    flags: list[tuple[Path, Sequence[str]]] = field(default_factory=list)
    compared: tuple[MethodComparison, Simulation, Simulation] | None = None  # of the first with the second

    def record(self) -> str:
        """All numbers as JSON."""
        record: dict[str, Any] = {"bodies": [one.record() for one in self.falls]}
        if self.compared is not None:
            record["comparison"] = comparison_record(self.compared[0], *self.falls)
        record["failures"] = [{"file": each.path, "error": each.what} for each in self.failures]
        return json.dumps(record, allow_nan=False, ensure_ascii=False, indent=1)

    def write(self, output: Path, progress: Progress = silent) -> None:
        """simulation.json, simulation.npz and filmstrips; comparison.png and .svg of two methods. Raises OSError."""
        write_falls(self.falls, output, self.record(), progress)
        if self.compared is not None:
            write_comparison(*self.compared[1:], (self.falls[0].path, self.falls[1].path), output)

    def lines(self) -> list[str]:
        """What stands under the table of falls: what is odd, what was assumed, why there is no verdict."""
        lines: list[str] = []
        for one in self.falls:
            lines += [f"! {one.path}: {flag}" for flag in one.flags]
            assumed = [note for note in one.notes if note.startswith(("up: ", "ground: "))]
            others = [note for note in one.notes if note not in assumed and not note.startswith("parts: ")]
            lines += [f"{one.path}: {note}" for note in (*others, *(["; ".join(assumed)] if assumed else []))]
        return [*lines, *dict.fromkeys(one.without_verdict for one in self.falls if one.without_verdict)]

    def comparison(self) -> tuple[list[str], list[list[str]], list[str]] | None:
        """Head and rows of the table of two methods, and the lines under it."""
        if self.compared is None:
            return None
        return *comparison_table(self.compared[0]), comparison_lines(self.compared[0], *self.falls)

    @contextmanager
    def _reported(self) -> Iterator[None]:
        try:
            yield
        except FileError as error:
            self.failures.append(error)

    def _read(self, path: Path, request: Request, progress: Progress) -> GroundedBodies:
        bodies = read_bodies(path, request, progress)
        self.flags.append((path, bodies.flags))
        return bodies


def simulate_files(
    paths: Paths, request: Request = AS_IT_IS, films: int = 0, progress: Progress = silent, **options: Any
) -> Falls:
    """Let the bodies of each file go; a file that cannot be read is among the failures.

    Args:
        paths: meshes, parameters, predictions (.npz), or folders of `ipman fit`.
        request: how they are read.
        films: pictures of so many falls of each file, evenly spaced over its bodies.
        options: engine, shape, times (s), step (s), friction, snap, tip_only; see `simulation.simulate` and `OPTIONS`.

    Raises:
        ValueError, TypeError: options of a wrong kind or range.
        ImportError: the engine is not installed.
    """
    options = _checked(options)
    result = Falls()
    for path in path_list(paths):
        with result._reported():
            bodies = result._read(path, request, progress)
            result.falls.append(run_falls(bodies, films, **options, progress=progress))
    return result


def compare_files(
    path: str | Path,
    other: str | Path,
    request: Request = AS_IT_IS,
    films: int = 0,
    progress: Progress = silent,
    **options: Any,
) -> Falls:
    """Let the same people's bodies by two methods go, and compare them; nothing is simulated where they cannot be
    paired, which is among the failures. Arguments as of `simulate_files`; raises as it does."""
    options = _checked(options)
    result = Falls()
    both: list[GroundedBodies] = []
    for each in (Path(path), Path(other)):
        with result._reported():
            both.append(result._read(each, request, progress))
    with result._reported():
        if not result.failures:
            pairs(*both)
            result.falls += [run_falls(bodies, films, **options, progress=progress) for bodies in both]
            result.compared = compare_falls(*result.falls)
    return result


def _checked(options: dict[str, Any]) -> dict[str, Any]:
    """All options, so that what is wrong with one is no failure of each file."""
    unknown = [name for name in options if name not in OPTIONS]
    if unknown:
        raise TypeError(f"options: expected some of {', '.join(OPTIONS)}, got {', '.join(unknown)}")
    options = {**OPTIONS, **options}
    options["times"] = spellings.argument("times", spellings.times, options["times"])
    checked_options(**{name: options[name] for name in ("engine", "shape", "times", "step", "friction", "snap")})
    return options
