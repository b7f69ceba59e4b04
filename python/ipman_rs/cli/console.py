"""What the terminal shows: the table and the notes on stdout, progress, warnings and errors on stderr."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager, nullcontext
from typing import Any

import numpy as np
from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn
from rich.table import Table
from rich.text import Text

from ..files.errors import one_line
from ..study.study import Study, flagged_name


def error(text: str) -> None:
    _line(f"ipman: error: {text}")


def warn(text: str) -> None:
    _line(f"ipman: warning: {text}")


def warn_of(path: object, flags: Iterable[str]) -> None:
    """What is odd about the bodies of a file, a line per flag."""
    for flag in flags:
        warn(f"{path}: {flag}")


def _line(text: str) -> None:
    import click

    click.echo(one_line(text, 600), err=True)


def say(text: str) -> None:
    import click

    click.echo(text)


class Step:
    """How far a piece of work is: `to` a number, or `one` further."""

    def __init__(self, bar: Progress, total: int | None, title: str) -> None:
        self._bar, self._task = bar, bar.add_task(one_line(title), total=total)

    def to(self, done: int) -> None:
        self._bar.update(self._task, completed=done)

    def one(self) -> None:
        self._bar.advance(self._task)

    def of(self, done: int, total: int) -> None:
        """For work that tells its length as it goes."""
        self._bar.update(self._task, completed=done, total=total)


@contextmanager
def progress(title: str, total: int | None = None) -> Iterator[Step]:
    """A bar on stderr while the work lasts; nothing where stderr is no terminal."""
    console = Console(stderr=True)
    columns = (TextColumn("{task.description}", markup=False), BarColumn(), MofNCompleteColumn(), TimeRemainingColumn())
    with Progress(*columns, console=console, transient=True, disable=not console.is_terminal) as bar:
        yield Step(bar, total, title)


@contextmanager
def busy(title: str) -> Iterator[None]:
    """A sign of life on stderr for work of unknown length; nothing where stderr is no terminal."""
    console = Console(stderr=True)
    with console.status(Text(one_line(title))) if console.is_terminal else nullcontext():
        yield


def print_table(studies: Sequence[Study]) -> None:
    """A line for each body or named pose; a recording's line has medians, and the smallest margin of its contacts.

    Stable: the CoM lies over the base of support (BoS).
    """
    table = Table(box=None, header_style="bold", pad_edge=False, padding=(0, 1))
    table.add_column("body" if not studies[0].labels else "pose", overflow="fold", min_width=14)
    for title in ("kg", "CoM–CoP mm", "margin mm", "BoS cm²", "contacts", "balance"):
        table.add_column(title, justify="right", no_wrap=True)
    table.add_column("stable", no_wrap=True)
    for study in studies:
        one_each = bool(study.labels) or study.num_frames == 1
        for frames in range(study.num_frames) if one_each else (slice(None),):
            table.add_row(*_row(study, frames))
    console = Console(highlight=False)
    if not console.is_terminal:
        console.width = 120
    console.print(table)


def _row(study: Study, frames: int | slice) -> list[Text]:
    value = {key: np.atleast_1d(column[frames]) for key, column in study.numbers.items() if column.ndim == 1}
    single = isinstance(frames, int)
    name = flagged_name(study.label(frames) if single else f"{study.name} ({study.num_frames} frames)", study.flags)
    stable = value["bose"].astype(bool)
    if single:
        said = "yes" if stable[0] else ("no" if value["has_contact"][0] else "no contact")
    else:
        said = f"{100 * stable.mean():.0f} %"
    cells = [
        one_line(name),
        _number(np.median(value["mass"]), 1, 1),
        _number(np.median(value["com_cop_distance"]), 1e3, 0),
        _number(value["margin"].min(where=value["has_contact"], initial=np.inf), 1e3, 0),
        _number(np.median(value["area"]), 1e4, 0),
        _number(np.median(value["num_contacts"]), 1, 0),
        _number(np.median(value["balance"]), 1, 2),
    ]
    return [*map(Text, cells), Text(said, style="green" if stable.all() else "red")]


def print_rows(head: Sequence[str], lines: Sequence[Sequence[str]]) -> None:
    """A table of text, its first column to the left."""
    table = Table(box=None, header_style="bold", pad_edge=False, padding=(0, 1))
    for number, title in enumerate(head):
        table.add_column(title, justify="left" if number == 0 else "right", overflow="fold")
    for line in lines:
        table.add_row(*(Text(one_line(cell)) for cell in line))
    console = Console(highlight=False)
    if not console.is_terminal:
        console.width = 200
    console.print(table)


def print_fits(studies: Sequence[Study]) -> None:
    """A line for each fitted body: how its fit went, how it stands, and what to look at."""
    table = Table(box=None, header_style="bold", pad_edge=False, padding=(0, 1))
    table.add_column("item", overflow="fold", min_width=14)
    table.add_column("converged", no_wrap=True)
    for title in ("iterations", "error px", "error %", "CoM–CoP mm", "margin mm"):
        table.add_column(title, justify="right", no_wrap=True)
    table.add_column("look", overflow="fold")
    for study in studies:
        if study.fitted is not None:
            table.add_row(*_fit_row(study, study.fitted.record))
    console = Console(highlight=False)
    if not console.is_terminal:
        console.width = 160
    console.print(table)


def _fit_row(study: Study, record: Mapping[str, Any]) -> list[Text]:
    value = {key: column[0] for key, column in study.numbers.items()}
    errors = record["reprojection"]
    said = "yes" if record["converged"] else f"no: {record['reason']}"
    cells = [
        str(record["iterations"]),
        _number(errors["median_px"], 1, 1),
        _number(errors["median_percent"], 1, 1),
        _number(value["com_cop_distance"], 1e3, 0),
        _number(value["margin"] if value["has_contact"] else np.inf, 1e3, 0),
        "; ".join(one_line(text) for text in (*study.flags, *record["notes"])),
    ]
    return [Text(one_line(study.name)), Text(said, style="green" if record["converged"] else "red"), *map(Text, cells)]


def _number(value: float, factor: float, digits: int) -> str:
    return f"{value * factor:.{digits}f}" if np.isfinite(value) else "–"


def print_validation(records: Sequence[Mapping[str, Any]]) -> None:
    """A line for each phase of each recording: weight, centre of mass and centre of pressure against the measured; and
    what is odd. A weight by plates that is not to be trusted has a mark."""
    table = Table(box=None, header_style="bold", pad_edge=False, padding=(0, 1))
    table.add_column("recording", overflow="fold", min_width=10)
    table.add_column("", no_wrap=True)
    for title in ("markers mm", "kg", "by plates", "CoM mm", "CoP: at rest mm", "ZMP mm", "γ = 10 mm"):
        table.add_column(title, justify="right", no_wrap=True)
    for one in records:
        compared = one["com"]["methods"]["exact"]["distance"] if one["com"] else None
        told = [
            (one["fit"]["markers"], 1e3),
            (one["mass"]["volume_mean"], 1),
            (one["mass"]["plates"], 1),
            (compared, 1e3),
        ]
        cells = [_known(value, factor) for value, factor in told]
        cells[2] += " !" if any(flag.startswith("weight by the plates") for flag in one["flags"]) else ""
        first = [one["name"], one["kind"], *cells]
        phases = one["cop"] or {"all": {"distance": {}}}
        for phase, found in phases.items():
            lead = first if phase == next(iter(phases)) else [""] * len(first)
            if phase != "all":
                lead[1] = f"{one['kind']}, {phase}"
            away = [found["distance"].get(name) for name in ("at rest: g(CoM)", "moving: ZMP of the parts", "γ = 10")]
            table.add_row(*(Text(one_line(cell)) for cell in [*lead, *(_known(value, 1e3) for value in away)]))
    console = Console(highlight=False)
    if not console.is_terminal:
        console.width = 160
    console.print(table)
    for one in records:
        for flag in one["flags"]:
            say(one_line(f"look: {one['name']}: {flag}"))


def _known(value: float | None, factor: float) -> str:
    return "–" if value is None else _number(value, factor, 1)


def print_notes(studies: Sequence[Study]) -> None:
    """What is odd and what was assumed, under each body's name."""
    for study in studies:
        say("")
        say(one_line(study.source))
        for flag in study.flags:
            say(f"! {one_line(flag)}")
        for note in study.notes:
            say(f"  {one_line(note)}")
