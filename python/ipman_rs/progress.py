"""How far a piece of work is: what the library's longer calls report to. By default they report to nobody."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, contextmanager
from typing import Protocol


class Step(Protocol):
    """A piece of work that is under way: `to` a number of its parts, `one` further, or a number `of` a total."""

    def to(self, done: int) -> None: ...

    def one(self) -> None: ...

    def of(self, done: int, total: int) -> None: ...


Progress = Callable[[str, int | None], AbstractContextManager[Step]]
"""Begins a piece of work with its title and the number of its parts, None where that is not known yet; the work ends
with the context."""


class _Silent:
    def to(self, done: int) -> None:
        pass

    def one(self) -> None:
        pass

    def of(self, done: int, total: int) -> None:
        pass


@contextmanager
def silent(title: str, total: int | None = None) -> Iterator[Step]:
    """The `Progress` that shows nothing."""
    yield _Silent()
