"""The one way in which a file fails: which file, what is wrong with it, and what to do; and how warnings are said."""

from __future__ import annotations

import os
import warnings
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any


class FileError(Exception):
    """``what`` is one line without the file's name; ``str()`` has both."""

    def __init__(self, path: str | os.PathLike[str], what: str) -> None:
        self.path = str(path)
        self.what = one_line(what.removeprefix(f"{path}: "))
        name = one_line(self.path)
        name = name if len(name) <= 160 else "…" + name[-159:]  # what is wrong is what must be read
        super().__init__(f"{name}: {self.what}")


def one_line(text: str, longest: int = 400) -> str:
    """Text for a terminal line: no line breaks, no control characters, not endless."""
    line = " ".join("".join(c if c.isprintable() else " " for c in text).split())
    return line if len(line) <= longest else line[: longest - 1] + "…"


@contextmanager
def warnings_in_one_line() -> Iterator[None]:
    """Warnings of the library are a line each on stderr, without Python's file names and source lines."""
    import click

    def show(message: Warning | str, category: type[Warning], *_place: Any) -> None:
        if not issubclass(category, (DeprecationWarning, ImportWarning)):
            click.echo(one_line(f"ipman: warning: {message}"), err=True)

    with warnings.catch_warnings():
        warnings.showwarning = show
        yield
