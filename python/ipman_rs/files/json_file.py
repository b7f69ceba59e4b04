"""Untrusted JSON: damage of any kind gives a ValueError that names the file."""

from __future__ import annotations

import json
import os
import re
import sys
from collections.abc import Callable
from typing import Any

from .regular import read_bytes

MAX_BYTES = 2 << 30  # COCO-WholeBody's annotations have a half of that
_LONG = re.compile(r"\d{300}")
_SURROGATE = re.compile(r"\\[uU][dD][89a-fA-F]")


Pairs = Callable[[list[tuple[str, Any]]], Any]  # makes a value of an object's names and values


def read_json(path: str | os.PathLike[str], pairs: Pairs | None = None) -> Any:
    """The content of a JSON file; objects as dictionaries, or what `pairs` makes of them.

    Raises:
        ValueError: there is no such file or no ordinary one, it is no JSON, is nested too deep for Python, or holds a
            whole number that no float can hold or text that is none; the message begins with the path.
    """
    try:
        return parse_json(read_bytes(path, MAX_BYTES), pairs)
    except ValueError as error:
        text = str(error)
        raise ValueError(text if text.startswith(f"{path}: ") else f"{path}: is no JSON: {text}") from None


def parse_json(data: bytes, pairs: Pairs | None = None) -> Any:
    """The content of JSON. ValueError as `read_json`, without a path."""
    try:
        text = data.decode("utf-8-sig" if data.startswith(b"\xef\xbb\xbf") else json.detect_encoding(data))
        content = json.loads(text, parse_int=_whole if _LONG.search(text) else None, object_pairs_hook=pairs)
        if _SURROGATE.search(text):
            json.dumps(content, ensure_ascii=False).encode()  # half a character cannot be written anywhere
        return content
    except UnicodeDecodeError:
        raise ValueError("it is no text") from None
    except RecursionError:
        raise ValueError("it is nested too deep") from None
    except MemoryError:
        raise ValueError("it needs more memory than there is") from None
    except UnicodeEncodeError:
        raise ValueError("it holds half a character (an unpaired surrogate)") from None


def _whole(digits: str) -> int:
    """A whole number, if a float can hold it."""
    if len(digits) > 310 or not abs(number := int(digits)) <= sys.float_info.max:
        raise ValueError(f"a number of {len(digits)} digits, more than any float has")
    return number
