"""The one way in which a file fails: which file, what is wrong with it, and what to do."""

from __future__ import annotations

import os


class FileError(Exception):
    """``what`` is one line without the file's name; ``str()`` has both."""

    def __init__(self, path: str | os.PathLike[str], what: str) -> None:
        self.path = str(path)
        self.what = one_line(what.removeprefix(f"{path}: "))
        super().__init__(f"{one_line(self.path)}: {self.what}")


def one_line(text: str) -> str:
    """Text for a terminal line: no line breaks, no control characters, not endless."""
    line = " ".join("".join(c if c.isprintable() else " " for c in text).split())
    return line if len(line) <= 400 else line[:399] + "…"
