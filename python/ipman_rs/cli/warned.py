"""How warnings are said on the command line."""

from __future__ import annotations

import warnings
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

from ..files.errors import one_line
from .flags import with_flags


@contextmanager
def warnings_in_one_line() -> Iterator[None]:
    """Warnings of the library are a line each on stderr, without Python's file names and source lines."""
    import click

    def show(message: Warning | str, category: type[Warning], *_place: Any) -> None:
        if not issubclass(category, (DeprecationWarning, ImportWarning)):
            click.echo(one_line(with_flags(f"ipman: warning: {message}")), err=True)

    with warnings.catch_warnings():
        warnings.showwarning = show
        yield
