"""Text files of laboratories: their lines, whatever the encoding, and numbers as C, Fortran and Windows write them."""

from __future__ import annotations

import codecs
import os
import re
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from ipman_rs.files import read_bytes

MAX_BYTES = 1 << 31  # an hour of sixty markers at 250 Hz has a third of that
UNEVEN = 0.02  # of a recording's length: that far equal times may be from evenly spaced ones
NOT_A_NUMBER = re.compile(
    r"[-+]?(?:s|q)?nan(?:\(\w*\))?|[-+]?1\.#(?:ind|qnan|snan|nan)\d*|n/?a|-+|null|none|missing", re.IGNORECASE
)
COMMA = re.compile(r"[-+]?\d*,\d+(?:e[-+]?\d+)?", re.IGNORECASE)
INFINITY = re.compile(r"([-+]?)(?:1\.#inf\d*|inf(?:inity)?)", re.IGNORECASE)


def lines(path: str | os.PathLike[str]) -> list[str]:
    """The lines of a file. ValueError, naming it, if it is missing, no ordinary file, or larger than any recording."""
    data = read_bytes(path, MAX_BYTES)
    wide = data.startswith((codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE))
    return data.decode("utf-16" if wide else "utf-8-sig", errors="replace").splitlines()


def number(text: str) -> float:
    """A number, NaN for each of its spellings, and for words and dashes that stand for none: "nan", "-nan(ind)",
    "1.#QNAN", "null", "-". ValueError for anything else."""
    try:
        return float(text)
    except ValueError:
        text = text.strip()
        if NOT_A_NUMBER.fullmatch(text):
            return np.nan
        infinite = INFINITY.fullmatch(text)
        if infinite:
            return float(f"{infinite[1]}inf")
        advice = "; decimals need a point, not a comma" if COMMA.fullmatch(text) else ""
        raise ValueError(f"'{text:.40}' is none{advice}") from None


def table(rows: Sequence[Sequence[str]], places: Sequence[str]) -> NDArray[np.float64]:
    """Numbers (n, width) of rows of one width. ValueError that begins with the place of a row without numbers."""
    try:
        return np.array(rows, np.float64)
    except ValueError:
        numbers = []
        for row, place in zip(rows, places, strict=True):
            try:
                numbers.append([number(cell) for cell in row])
            except ValueError as error:
                raise ValueError(f"{place}: expected numbers: {error}") from None
        return np.array(numbers, np.float64)


def seconds(times: NDArray[np.float64], lines: Sequence[int], path: str, notes: list[str]) -> NDArray[np.float64]:
    """Times (T,) of a table's rows, whose lines have these numbers. Equal ones, as rounded ones are, are spread evenly.

    ValueError, naming the file and line, for a row without a time, for times that go back, and for equal ones among
    others that are not even.
    """
    if np.isnan(times).any():
        line = lines[int(np.isnan(times).argmax())]
        raise ValueError(f"{path}: line {line}: expected seconds in the column Time, it is blank or no number")
    steps = np.diff(times)
    if not np.isfinite(times).all() or (steps < 0).any():
        row = int((~np.isfinite(times)).argmax() if not np.isfinite(times).all() else (steps < 0).argmax() + 1)
        raise ValueError(f"{path}: line {lines[row]}: expected times that increase, got {times[row]:g} s")
    if not (steps == 0).any():
        return times
    if times[-1] == times[0]:
        raise ValueError(f"{path}: line {lines[1]}: expected times that increase, all are {times[0]:g} s")
    even = np.linspace(times[0], times[-1], len(times))
    if np.abs(even - times).max() > max(2 * steps[steps > 0].min(), UNEVEN * (times[-1] - times[0])):
        row = int((steps == 0).argmax()) + 1
        raise ValueError(
            f"{path}: line {lines[row]}: expected times that increase, got {times[row]:g} s again, and the others are "
            f"not evenly spaced"
        )
    notes.append("some times are equal: they are taken as evenly spaced from the first to the last")
    return even
