"""Only ordinary files are opened, because a pipe waits for a writer and a device never ends."""

from __future__ import annotations

import os
import stat
from pathlib import Path

_KINDS = {
    stat.S_IFDIR: "is a folder; name the file in it",
    stat.S_IFIFO: "is a pipe, not an ordinary file",
    stat.S_IFSOCK: "is a socket, not an ordinary file",
    stat.S_IFCHR: "is a device, not an ordinary file",
    stat.S_IFBLK: "is a device, not an ordinary file",
}


def regular_file(path: str | os.PathLike[str]) -> Path:
    """The path of an ordinary file, or of a link to one.

    Raises:
        ValueError: nothing is there, or a folder, pipe, socket or device; the message begins with the path.
    """
    try:
        kind = stat.S_IFMT(os.stat(path).st_mode)
    except FileNotFoundError:
        raise ValueError(f"{path}: there is no such file") from None
    except (OSError, ValueError) as error:  # ValueError: a name with a zero byte
        raise ValueError(f"{path!s}: cannot be opened ({getattr(error, 'strerror', None) or error})") from None
    if kind != stat.S_IFREG:
        raise ValueError(f"{path}: {_KINDS.get(kind, 'is not an ordinary file')}")
    return Path(path)


def read_bytes(path: str | os.PathLike[str], most: int) -> bytes:
    """The content of an ordinary file of at most `most` bytes.

    Raises:
        ValueError: as `regular`, or the file is larger or cannot be read; the message begins with the path.
    """
    place = regular_file(path)
    try:
        with place.open("rb") as stream:
            data = stream.read(most + 1)  # the size that a file of /proc claims is 0
    except OSError as error:
        raise ValueError(f"{path}: cannot be read ({error.strerror or error})") from None
    except MemoryError:
        raise ValueError(f"{path}: needs more memory than there is") from None
    if len(data) > most:
        raise ValueError(f"{path}: has more than the {most} bytes that such a file may have; is it the right file?")
    return data
