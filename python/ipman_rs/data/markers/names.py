"""Which place on the body each marker of a file means, by its name.

Names are compared free of case and punctuation, the side first: `L_ASIS`, `L.ASIS`, `lasis`, `ASIS_L` and `Left ASIS`
are one. What stands before a colon is the subject; a beginning or an end that most names of a file share ("Subject_",
"S01", "_study") is left out where the name is known without it.
"""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Iterable, Mapping, Sequence

from ipman_rs.data.tracks import alphanumeric

from ...body.sites import FEWEST_POINTS
from .aliases import KEYPOINTS
from .sets import MARKERS, Meaning

SHARED = 0.5  # of a file's names: a beginning or an end that so many have says nothing
FEWEST = 3
SUFFIXES = {
    "study", "marker", "markers", "mkr", "pos", "position", "raw", "filt", "filtered", "smooth", "smoothed", "traj",
    "trajectory", "interp",
}  # fmt: skip
SIDES = {"l": "l", "left": "l", "r": "r", "right": "r"}
# Ends that say where a marker is, though many names may have them.
TELLING = {
    "l", "r", "left", "right", "lat", "med", "lateral", "medial", "in", "out", "int", "ext", "jc", "joint", "centre",
    "center", "reg", "sup", "inf", "ant", "post", "up", "front", "rear", "top", "bottom", "upper", "lower", "x", "y",
    "z",
}  # fmt: skip


def comparable(name: str) -> str:
    """A marker's name for comparison: small letters and digits, without the subject, its side first, as `l` or `r`."""
    words = [word.lower() for word in re.split(r"[\W_]+", name.rpartition(":")[2]) if word]
    if len(words) > 1 and words[-1] in SIDES and words[0] not in SIDES:
        words = [words[-1], *words[:-1]]
    if len(words) > 1 and words[0] in SIDES:
        words[0] = SIDES[words[0]]
    joined = "".join(words)
    for side in ("left", "right"):
        if joined.startswith(side) and len(joined) > len(side):
            return side[0] + joined.removeprefix(side)
    return joined


_KNOWN: dict[str, Meaning] = {comparable(name): meaning for name, meaning in MARKERS.items()}
_KEYPOINTS: dict[str, Meaning] = {comparable(name): meaning for name, meaning in KEYPOINTS.items()}


def meanings(names: Sequence[str], own: Mapping[str, Meaning | None] | None = None) -> dict[str, Meaning]:
    """What the markers of one file mean; those that nobody knows are left out.

    `own`: further names and what they mean, before the known ones; None leaves a marker out. Of two names that come to
    the same one, the one that needed the least taken away counts. Files of keypoints, which name the hips, mean joints
    by "RKnee".
    """
    own_meanings = {comparable(name): meaning for name, meaning in (own or {}).items()}
    ends = _shared_ends(names)
    ways = [_variants(name, ends) for name in names]
    points = {"lhip", "rhip"} <= {comparable(name) for name in names}
    matches = _match(names, ways, own_meanings, _KNOWN, skipped=_KEYPOINTS if points else {})
    if points and len(matches) < FEWEST_POINTS:  # with as many markers, keypoints in the file are not needed
        return _match(names, ways, own_meanings, _KEYPOINTS, skipped={})
    return matches


def _match(
    names: Sequence[str],
    ways: Sequence[Sequence[str]],
    own: Mapping[str, Meaning | None],
    known: Mapping[str, Meaning],
    skipped: Mapping[str, Meaning],
) -> dict[str, Meaning]:
    taken: dict[str, tuple[int, str]] = {}  # by comparable name: how much was taken away, and from which marker
    for name, variants in zip(names, ways, strict=True):
        for steps, variant in enumerate(variants):
            key = comparable(variant)
            if (key in own or key in known) and not (steps == 0 and key in skipped and key not in own):
                if key not in taken or steps < taken[key][0]:
                    taken[key] = steps, name
                break
    meant = {name: own.get(key, known.get(key)) for key, (_, name) in taken.items()}
    return {name: meaning for name in names if (meaning := meant.get(name)) is not None}


def unmatched(names: Sequence[str], own: Iterable[str]) -> list[str]:
    """Which of a user's `own` names are those of no marker of a file, as `meanings` compares them."""
    ends = _shared_ends(names)
    known = {comparable(variant) for name in names for variant in _variants(name, ends)}
    return [name for name in own if comparable(name) not in known]


def _variants(name: str, ends: tuple[Sequence[str], Sequence[str]]) -> list[str]:
    """A name, and what is left of it without a shared beginning, end, or both."""
    beginnings, endings = ends
    name = name.rpartition(":")[2]
    shorter = [name]
    for beginning in beginnings:
        shorter += [text.removeprefix(beginning) for text in shorter if text.startswith(beginning)]
    for ending in endings:
        shorter += [text.removesuffix(ending) for text in shorter if text.endswith(ending)]
    return [text for text in dict.fromkeys(shorter) if text]


def _shared_ends(names: Sequence[str]) -> tuple[list[str], list[str]]:
    """The beginnings ("Subject_") and ends ("_study") that most of these names share, with their punctuation."""
    names = [name.rpartition(":")[2] for name in names]
    enough = max(FEWEST, SHARED * len(names))
    words = r"(?:[^\W_]+[\W_]+){%d}(?=\w)"
    first = Counter(match[0] for n in (3, 2, 1) for name in names if (match := re.match(words % n, name)))
    first += Counter(match[0] for name in names if (match := re.match(r"[A-Za-z]+\d+(?=[A-Za-z])", name)))  # S01LASI
    last = Counter(match[0] for name in names if (match := re.search(r"(?<=\w)[\W_]+[^\W_]+$", name)))
    beginnings = [text for text, count in first.items() if count >= enough and not _is_informative(text)]
    endings = [
        text
        for text, count in last.items()
        if not _is_informative(text) and (count >= enough or alphanumeric(text) in SUFFIXES)
    ]
    return beginnings, endings


def _is_informative(text: str) -> bool:
    return alphanumeric(text) in TELLING
