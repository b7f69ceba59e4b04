"""Units of length, force and moment, as files write them: "mm", "MILLIMETERS", "mete", "Nt", "N·mm"."""

from __future__ import annotations

import re

from .. import spellings

METRES = {**spellings.METRES, "meters": 1.0, "metres": 1.0, "um": 1e-6}
WORDS = {  # in full, so that what a field of four characters left of one is known by its beginning
    "metres": 1.0,
    "meters": 1.0,
    "decimetres": 0.1,
    "decimeters": 0.1,
    "centimetres": 0.01,
    "centimeters": 0.01,
    "millimetres": 0.001,
    "millimeters": 0.001,
    "micrometres": 1e-6,
    "micrometers": 1e-6,
    "inches": 0.0254,
    "feet": 0.3048,
    "foot": 0.3048,
}
SHORT = METRES | {"inch": 0.0254, "mtr": 1.0, "mtrs": 1.0, "mms": 0.001, "cms": 0.01}
LEAST = 4  # letters of the beginning of a word
NEWTONS = {"newtons": 1.0, "newton": 1.0, "newt": 1.0, "nts": 1.0, "nt": 1.0, "kn": 1000.0, "n": 1.0}


def metres(unit: str) -> float | None:
    """Metres in a unit of length; None for another one."""
    return _length(_plain(unit))


def newtons(unit: str) -> float | None:
    """Newtons in a unit of force; None for another one."""
    return NEWTONS.get(_plain(unit))


def newton_metres(unit: str) -> float | None:
    """Newton metres in a unit of moment; None for another one."""
    plain = _plain(unit)
    for force, factor in NEWTONS.items():  # the longest first
        length = _length(plain.removeprefix(force)) if plain.startswith(force) else None
        if length is not None:
            return factor * length
        length = _length(plain.removesuffix(force)) if plain.endswith(force) else None
        if length is not None and len(force) > 1:  # "mm-Newton"; but "mn" could be a thousandth of a newton
            return factor * length
    return None


def _length(plain: str) -> float | None:
    if plain in SHORT:
        return SHORT[plain]
    meant = {metres for word, metres in WORDS.items() if len(plain) >= LEAST and word.startswith(plain)}
    singular = {metres for word, metres in WORDS.items() if plain == word.removesuffix("s")}
    return (meant | singular).pop() if len(meant | singular) == 1 else None


def _plain(unit: str) -> str:
    """Without case, blanks, and what stands between the parts of a product: "N·m", "N*m", "N-m", "(Nm)"."""
    return re.sub(r"[\s.,*·⋅∙•×_()\[\]{}'\"\x00-]", "", unit.replace("µ", "u").replace("μ", "u")).lower()
