"""Untrusted YAML: plain values only; any damage gives a ValueError that names the file."""

from __future__ import annotations

import codecs
import os
import sys
from typing import Any

from .regular import read_bytes

MAX_BYTES = 1 << 18  # the longest preset has a hundredth of that
MAX_VALUES = 100_000  # with what aliases repeat
MAX_DEPTH = 50


def read_yaml(path: str | os.PathLike[str]) -> Any:
    """The content of a YAML file: dictionaries, lists, text, numbers, truth values and None.

    Raises:
        ValueError: there is no such file or no ordinary one, it is no YAML, or holds anything else, too much, or nested
            too deep; the message begins with the path.
    """
    try:
        return parse_yaml(_text(read_bytes(path, MAX_BYTES)))
    except ValueError as error:
        text = str(error)
        raise ValueError(text if text.startswith(f"{path}: ") else f"{path}: is no YAML: {text}") from None


def _text(data: bytes) -> str:
    """In UTF-8, or in UTF-16 with its byte order mark, as YAML may be."""
    wide = data.startswith((codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE))
    try:
        return data.decode("utf-16" if wide else "utf-8-sig")
    except UnicodeDecodeError:
        raise ValueError("it is no text in UTF-8; save it as UTF-8") from None


def parse_yaml(text: str) -> Any:
    """The content of YAML. ValueError as `read_yaml`, without a path."""
    import yaml

    try:
        content = yaml.safe_load(text)
        _count(content, MAX_VALUES, MAX_DEPTH)
        return content
    except RecursionError:
        raise ValueError("it is nested too deep") from None
    except MemoryError:
        raise ValueError("it needs more memory than there is") from None
    except yaml.YAMLError as error:
        raise ValueError(" ".join(str(error).split())) from None
    except (ArithmeticError, TypeError, LookupError, AttributeError) as error:  # its own slips, such as "!!float" alone
        raise ValueError(f"{type(error).__name__}: {error}") from None


def _count(content: Any, room: int, depth: int) -> int:
    """How many more values there may be after these. Aliases can repeat a value without end, or hold themselves."""
    if room <= 0 or depth <= 0:
        raise ValueError(f"it has more than {MAX_VALUES} values, or is nested more than {MAX_DEPTH} deep")
    room -= 1
    if isinstance(content, dict):
        for key, value in content.items():
            if not isinstance(key, (str, int, float)) and key is not None:
                raise ValueError(f"a {type(key).__name__} as a name")
            room = _count(value, _count(key, room, depth - 1), depth - 1)
    elif isinstance(content, list):
        for value in content:
            room = _count(value, room, depth - 1)
    elif isinstance(content, str):
        content.encode()  # half a character cannot be written anywhere
    elif isinstance(content, int):
        if not abs(content) <= sys.float_info.max:
            raise ValueError("a whole number that no float can hold")
    elif content is not None and not isinstance(content, float):
        raise ValueError(f"a {type(content).__name__} where a number, text or a list is expected")
    return room
