"""What the terminal shows: the table and the notes on stdout, progress, warnings and errors on stderr."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager, nullcontext

from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn
from rich.table import Table
from rich.text import Text

from ..files.errors import one_line
from ..study.study import Study
from ..study.table import fit_table, study_table
from .flags import with_flags


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

    click.echo(one_line(with_flags(text), 600), err=True)


def say(text: str) -> None:
    import click

    click.echo(with_flags(text))


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


def print_rows(head: Sequence[str], lines: Sequence[Sequence[str]]) -> None:
    """A table of text, its first column to the left."""
    table = _table()
    for number, title in enumerate(head):
        table.add_column(title, justify="left" if number == 0 else "right", overflow="fold")
    for line in lines:
        table.add_row(*map(_cell, line))
    _print(table, 200)


def print_colored(
    head: Sequence[str],
    rows: Iterable[tuple[Sequence[str], str]],
    colored: str,
    words: Mapping[str, int | None],
    width: int = 160,
) -> None:
    """A table of numbers, rows with the colour of what is in the column `colored`. `words`: the columns of words,
    which wrap, and their share of the width where they fill it. `width`: in characters, where there is no terminal."""
    table = _table()
    for number, title in enumerate(head):
        if title in words:
            table.add_column(title, overflow="fold", ratio=words[title], min_width=14 if number == 0 else None)
        else:
            table.add_column(title, justify="left" if title == colored else "right", no_wrap=True)
    for cells, color in rows:
        table.add_row(*(_cell(cell, color if head[k] == colored else "") for k, cell in enumerate(cells)))
    _print(table, width)


def _cell(text: str, style: str = "") -> Text:
    return Text(one_line(with_flags(text)), style=style)


def _table() -> Table:
    return Table(box=None, header_style="bold", pad_edge=False, padding=(0, 1))


def _print(table: Table, width: int) -> None:
    console = Console(highlight=False)
    if not console.is_terminal:
        console.width = width
    console.print(table)


def print_table(studies: Sequence[Study]) -> None:
    """A line for each body, named pose or recording: see `study_table`."""
    head, rows = study_table(studies)
    print_colored(head, map(_green_or_red, rows), "stable", {head[0]: None}, width=120)


def print_fits(studies: Sequence[Study]) -> None:
    """A line for each fitted body: see `fit_table`."""
    head, rows = fit_table(studies)
    print_colored(head, map(_green_or_red, rows), "converged", {"item": None, "notes": None})


def _green_or_red(row: tuple[list[str], bool]) -> tuple[list[str], str]:
    return row[0], "green" if row[1] else "red"


def print_notes(studies: Sequence[Study]) -> None:
    """What is odd and what was assumed, under each body's name."""
    for study in studies:
        say("")
        say(one_line(study.source))
        for flag in study.flags:
            say(f"! {one_line(flag)}")
        for note in study.notes:
            say(f"  {one_line(note)}")
