"""Lines of a text file of any encoding and line ends, and lists of names for notes."""

from __future__ import annotations

import codecs
from collections.abc import Sequence


def lines(content: bytes) -> list[bytes]:
    """Lines of any encoding with ASCII's bytes, and of UTF-16 with its byte order mark. ValueError for other bytes."""
    if content.startswith((codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE)):
        content = content.decode("utf-16").encode()
    content = content.removeprefix(codecs.BOM_UTF8)
    if b"\0" in content:
        raise ValueError("it holds zero bytes and so is no text; save it as UTF-8")
    return content.replace(b"\r\n", b"\n").replace(b"\r", b"\n").split(b"\n")


def name(words: bytes) -> str:
    return words.decode("utf-8", "replace")


def list_names(names: Sequence[object], most: int = 4) -> str:
    """'a, b, c': printable, and no longer than a line of a report."""
    short = ["".join(c if c.isprintable() else " " for c in str(one)).strip()[:40] or "unnamed" for one in names[:most]]
    more = len(names) - len(short)
    return ", ".join(short) + (f" and {more} more" if more else "")


def count_of(count: int, noun: str, plural: str | None = None) -> str:
    """'1 face', '2 faces'."""
    return f"{count} {noun if count == 1 else plural or noun + 's'}"
