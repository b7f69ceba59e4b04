"""`FileError`: which file, what is wrong with it, and what to do."""

from __future__ import annotations

import os


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
