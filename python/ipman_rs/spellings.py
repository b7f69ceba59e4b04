"""How axes, lengths, heights, rates, image sizes and times are spelled: as words ("-z", "mm", "auto", "1920x1080"),
as on the command line, or as the numbers that they stand for.

Each function takes either, and gives numbers. Raises ValueError with what is wrong; `argument` says of which argument.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable
from typing import Any, TypeVar

METRES = {"m": 1.0, "dm": 0.1, "cm": 0.01, "mm": 0.001, "km": 1000.0, "in": 0.0254, "ft": 0.3048, "yd": 0.9144}
_AXES = {"x": (1.0, 0.0, 0.0), "y": (0.0, 1.0, 0.0), "z": (0.0, 0.0, 1.0)}

Axis = tuple[float, float, float]
Size = tuple[float, float]
Spelled = Any  # a field that takes words or numbers, and holds numbers once `read_fields` has read it
T = TypeVar("T")


def argument(name: str, read: Callable[[Any], T], value: Any) -> T | None:
    """`value` as `read` reads it, None as it is. ValueError that names the argument."""
    if value is None:
        return None
    try:
        return read(value)
    except ValueError as error:
        raise ValueError(f"{name}: {error}") from None


def read_fields(record: Any, **read: Callable[[Any], Any]) -> None:
    """Reads fields of a frozen dataclass in its place. ValueError that names the field."""
    for name, reader in read.items():
        object.__setattr__(record, name, argument(name, reader, getattr(record, name)))


def axis(value: str | Iterable[float]) -> Axis:
    """x, y, z, -x, -y, -z, or a normal: three numbers, or "0,0.1,1"."""
    word = value.strip().lower() if isinstance(value, str) else ""
    if word.lstrip("+-") in _AXES and len(word) <= 2:
        sign = -1.0 if word.startswith("-") else 1.0
        x, y, z = _AXES[word.lstrip("+-")]
        return sign * x, sign * y, sign * z
    normal = _numbers(value, ",")
    if len(normal) != 3 or not all(map(math.isfinite, normal)) or not any(normal):
        raise ValueError(f"{value!r} is neither one of x, y, z, -x, -y, -z nor a normal such as 0,0,1")
    return normal[0], normal[1], normal[2]


def unit(value: str | float) -> float:
    """Metres in a unit of length: a word of `METRES`, or their number."""
    metres = METRES.get(value.strip().lower()) if isinstance(value, str) else None
    metres = _number(value) if metres is None else metres
    if not 0 < metres < math.inf:
        raise ValueError(f"{value!r} is none of {', '.join(METRES)}, and no number of metres such as 0.001")
    return metres


def rate(value: str | float) -> float:
    """Frames a second."""
    hertz = _number(value)
    if not 0 < hertz < math.inf:
        raise ValueError(f"{value!r} is no number of frames a second above 0")
    return hertz


def height_or(word: str) -> Callable[[str | float], float | None]:
    """Reads metres, and None for the word."""

    def read(value: str | float) -> float | None:
        if isinstance(value, str) and value.strip().lower() == word:
            return None
        height = _number(value)
        if not math.isfinite(height):
            raise ValueError(f"{value!r} is neither a height in metres nor {word}")
        return height

    return read


def image_size(value: str | Iterable[float]) -> Size:
    """Width and height in pixels: two numbers, or "1920x1080"."""
    sides = _numbers(value, "x")
    if len(sides) != 2 or not all(0 < side < math.inf for side in sides):
        raise ValueError(f"{value!r} is no width and height in pixels such as 1920x1080")
    return sides[0], sides[1]


def times(value: str | Iterable[float]) -> tuple[float, ...]:
    """Ascending seconds: numbers, or "0.41667,2"."""
    seconds = _numbers(value, ",")
    if not seconds or not all(0 <= time < math.inf for time in seconds) or list(seconds) != sorted(seconds):
        raise ValueError(f"{value!r} is no ascending list of seconds such as 0.41667,2")
    return seconds


def setting(text: str) -> tuple[str, str | int | float]:
    """A name and a word or number: "frame=camera"."""
    name, equals, word = text.partition("=")
    if not name or not equals:
        raise ValueError(f"{text!r} is no option such as frame=camera")
    for number in (int, float):
        try:
            return name, number(word)
        except ValueError:
            continue
    return name, word


def shard(text: str) -> tuple[int, int]:
    """Number and count, from 1: "2/7"."""
    words = text.split("/")
    if len(words) != 2 or not all(word.isdecimal() for word in words) or not 1 <= int(words[0]) <= int(words[1]):
        raise ValueError(f"{text!r} is no shard such as 2/7, the second of seven")
    return int(words[0]), int(words[1])


def _numbers(value: str | Iterable[float], between: str) -> tuple[float, ...]:
    """Of a list, or of text with `between` between them; none of what is no list."""
    if isinstance(value, str):
        return tuple(map(_number, value.lower().split(between)))
    try:
        return tuple(map(_number, value))
    except TypeError:
        return ()


def _number(value: Any) -> float:
    """NaN for what is none."""
    try:
        return math.nan if isinstance(value, bool) else float(value)
    except (TypeError, ValueError):
        return math.nan
