"""Atomic writing: a file is complete or absent, whenever the process ends and whoever else writes there."""

from __future__ import annotations

import contextlib
import os
import re
import secrets
from pathlib import Path
from typing import IO, Any, BinaryIO

try:
    import fcntl
except ImportError:  # Windows, which deletes no file that is open
    fcntl = None  # type: ignore[assignment]

_PART = re.compile(r"\.(?P<name>.+)\.[0-9a-f]{12}\.part")


class atomic_write:
    """A file that appears under its name when it is complete: a killed process leaves the old file, or none.

    with atomic_write(path) as file: file.write(...)

    It is written in the same folder under a temporary name and then renamed; a failure removes it. Leftovers of a
    killed process are removed by the next writer of the same file; a living writer holds a lock.
    """

    def __init__(self, path: str | os.PathLike[str]) -> None:
        self.path = Path(path)

    def __enter__(self) -> BinaryIO:
        _remove_leftovers(self.path)
        self.part, self.file = _part(self.path)
        return self.file

    def __exit__(self, kind: Any, *_: Any) -> None:
        try:
            try:
                if kind is None:
                    self.file.flush()
                    os.fsync(self.file.fileno())
                    if os.name != "nt":
                        os.replace(self.part, self.path)  # still locked, so that nobody takes it for a leftover
            finally:
                self.file.close()
            if kind is None and os.name == "nt":
                os.replace(self.part, self.path)
        finally:
            self.part.unlink(missing_ok=True)


def write_whole(path: str | os.PathLike[str], content: bytes | str) -> None:
    """Write a file, text as UTF-8, so that it is there whole or not at all. Raises OSError."""
    with atomic_write(path) as file:
        file.write(content.encode(errors="replace") if isinstance(content, str) else content)  # names need not be text


def _part(path: Path) -> tuple[Path, BinaryIO]:
    """A new file beside the path, open and locked."""
    name = path.name.encode()[:200].decode(errors="ignore")  # file systems allow 255 bytes
    while True:
        part = path.with_name(f".{name}.{secrets.token_hex(6)}.part")
        file = part.open("xb")
        try:
            _lock(file)
        except BlockingIOError:  # another process takes it for a leftover
            file.close()
            continue
        except OSError:  # a file system without locks, on which no leftovers are removed
            return part, file
        if part.exists():
            return part, file
        file.close()


def _lock(file: IO[bytes]) -> None:
    """OSError where another process has locked it, or the file system has no locks."""
    if fcntl is not None:
        fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)


def _remove_leftovers(path: Path) -> None:
    """Unlocked parts of the same file."""
    name = path.name.encode()[:200].decode(errors="ignore")
    try:
        entries = [entry for entry in os.scandir(path.parent) if entry.name.startswith(f".{name}.")]
    except OSError:
        return
    for entry in entries:
        match = _PART.fullmatch(entry.name)
        if match is None or match["name"] != name:
            continue
        with contextlib.suppress(OSError), open(entry.path, "rb") as left:
            _lock(left)
            os.unlink(entry.path)
