"""Tracks: the recorded positions of markers over time."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ipman_rs.renamed import old_names

from .units import METRES, metres

__all__ = ["METRES", "TO_Y_UP", "MarkerColumns", "Tracks", "rate_of", "select_markers", "tracks"]

__getattr__ = old_names(__name__, {"Named": "MarkerColumns", "named": "select_markers"})

Array = NDArray[np.float64]

# Rotations that lead from a file's axes to ours, y up.
TO_Y_UP = {
    "x": np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]]),
    "y": np.eye(3),
    "z": np.array([[1.0, 0.0, 0.0], [0.0, 0.0, 1.0], [0.0, -1.0, 0.0]]),
}
LARGEST = 20.0  # nobody's markers are farther apart, in metres; in millimetres everybody's are
BREAK = 2.5  # times the usual step between two samples; rounded times differ by up to twice of it
FARTHEST = 1e7  # in any unit: programs write a number beyond it for what was not seen, NDI's -3.697314e28
# 999, 9999.99, 99999.9 …: what programs write for a marker that was not seen.
NINES = np.array([10.0**whole - 10.0**-part for whole in range(3, 8) for part in range(8 - whole)])
MORE_NINES = np.array([float("9" * whole + "." + "9" * part) for whole in range(3, 8) for part in range(8 - whole, 9)])
WORDS = 32767.0, 32768.0, 2147483648.0  # the last integers, which mean the same
OFTEN = 3  # samples in which a place stands for what was not seen
MOST = 200_000  # repeated places that are compared
CANDIDATES = 3  # of them that occur the most
FEWEST_OF_A_PERSON = 6  # markers of one name before the colon: a ball, a bat or a wand has fewer
NAMELESS = re.compile(r"\*\d*|(?:unlabell?ed|unnamed|uname)[ _*-]*\d*", re.IGNORECASE)


NO_SUBJECT = '"" (without a name before a colon)'


@dataclass(frozen=True, eq=False)
class Tracks:
    """M markers in T samples, metres, y up. A marker that was not seen has confidence 0 and lies at 0."""

    names: tuple[str, ...]  # M
    points: Array  # (T, M, 3) m
    confidence: Array  # (T, M), 0 or 1
    times: Array  # (T,) s
    source: str
    notes: tuple[str, ...] = ()  # what of the file was left out or mended, a sentence each
    up: str = "y"  # the file's own axis that points up
    unit: float = 1.0  # metres in one of the file's lengths

    def __len__(self) -> int:
        return len(self.times)

    @property
    def rate(self) -> float:
        """Samples a second; 0 of a single one."""
        return rate_of(self.times)

    def select(self, names: Sequence[str]) -> Tracks:
        """These markers, in this order. ValueError for one that was not recorded."""
        column = {name: index for index, name in enumerate(self.names)}
        missing = [name for name in names if name not in column]
        if missing:
            raise ValueError(f"names: {self.source} has no marker {missing[0]!r}; it has {', '.join(self.names)}")
        columns = [column[name] for name in names]
        return replace(self, names=tuple(names), points=self.points[:, columns], confidence=self.confidence[:, columns])


def rate_of(times: Array) -> float:
    """Samples a second, by the first time and the last: single ones are often rounded to milliseconds. 0 of one.

    Time for which nothing was recorded is left out (`breaks`).
    """
    lasted = float(times[-1] - times[0]) if len(times) > 1 else 0.0
    if not lasted > 0:
        return 0.0
    steps, within = np.diff(times), ~breaks(times)
    if within.all():
        return (len(times) - 1) / lasted
    return float(within.sum() / steps[within].sum())


def breaks(times: Array) -> NDArray[np.bool_]:
    """Which of the steps (T - 1,) between times are far longer than the others: the recording was interrupted."""
    steps = np.diff(times)
    return steps > BREAK * np.median(steps) if len(steps) > 2 else np.zeros(len(steps), bool)


def tracks(
    names: Sequence[str],
    points: Array,
    times: Array,
    unit: str | float,
    up: str,
    source: str,
    *,
    subject: str | None = None,
    notes: Sequence[str] = (),
) -> Tracks:
    """From a file's own numbers: NaN, exactly the origin, or a number that stands for it is a marker that was not seen.

    `unit`: its name, or metres in one; "" is guessed. Names as `select_markers` has them. ValueError for an unknown
    unit, axis or subject, for no marker or sample, for two people, if nothing was seen, and for infinite coordinates.
    """
    if up not in TO_Y_UP:
        raise ValueError(f"{source}: up: expected x, y or z, got {up!r}")
    if points.size == 0:
        raise ValueError(f"{source}: expected markers and samples, got {points.shape[1]} and {points.shape[0]}")
    if np.isinf(points).any():
        sample, marker, _ = np.argwhere(np.isinf(points))[0]
        raise ValueError(f"{source}: sample {sample}, marker {names[marker]!r}: expected numbers, got infinity")
    visible, mended = visibility(points, names)
    chosen = select_markers(names, visible, source, subject)
    if not chosen.names:
        raise ValueError(f"{source}: expected markers with names, none of its {len(names)} points has one: label them")
    points, visible = points[:, chosen.columns], visible[:, chosen.columns]
    if not visible.any():
        raise ValueError(f"{source}: expected coordinates, all are missing")
    scale = _scale(unit, points[visible], source)
    turned = np.where(visible[..., None], points, 0.0) * scale @ TO_Y_UP[up].T
    guessed = [unit_note(likely_unit(points[visible]))] if unit == "" else []
    all_notes = (*notes, *mended, *chosen.notes, *guessed, *_gaps(times))
    return Tracks(chosen.names, turned, visible.astype(float), np.asarray(times, float), source, all_notes, up, scale)


def _gaps(times: Array) -> list[str]:
    rows = np.flatnonzero(breaks(np.asarray(times, float)))
    places = [f"t = {times[row]:.4g} s (of {times[row + 1] - times[row]:.3g} s)" for row in rows]
    if not places:
        return []
    what = "a gap" if len(places) == 1 else f"{len(places)} gaps"
    return [f"its times have {what}, at {list_names(places, 3)}: the frames before and after are taken as neighbours"]


def turn_up(tracks: Tracks, normal: Sequence[float]) -> Tracks:
    """The tracks with this direction of theirs, (3,), turned to +y by the shortest way."""
    up = np.asarray(normal, float) / np.linalg.norm(normal)
    if up[1] < -1 + 1e-12:
        rotation = np.diag([1.0, -1.0, -1.0])
    else:
        skew = np.cross(np.eye(3), np.cross(up, [0.0, 1.0, 0.0]))
        rotation = np.eye(3) + skew + skew @ skew / (1 + up[1])
    return replace(tracks, points=tracks.points @ rotation.T)


def visibility(points: Array, names: Sequence[str]) -> tuple[NDArray[np.bool_], list[str]]:
    """Where markers (T, M, 3) were seen, (T, M); and notes on the numbers that mark a marker as not seen."""
    origin = (points == 0).all(-1)
    there = ~np.isnan(points).any(-1) & ~origin
    with np.errstate(invalid="ignore"):
        size = np.abs(points)
        nines = (size >= 999) & (size < FARTHEST)
        large = size[nines]  # within half of float32's spacing, or with digits that only text has
        nines[nines] = np.isclose(large[:, None], NINES, rtol=6e-8, atol=0).any(-1) | np.isin(large, MORE_NINES)
        far = (size >= FARTHEST).any(-1)
        alike = (size == size[..., :1]).all(-1)
    stands = far | (nines & (size >= 9999)).any(-1) | (alike & (nines.all(-1) | np.isin(size[..., 0], WORDS)))
    stands &= there
    notes = []
    if origin.any():
        notes.append(_not_seen("0, 0, 0", origin, names))
    if stands.any():
        first = points[stands][0]
        notes.append(_not_seen(f"{first[int(np.abs(first).argmax())]:.7g}", stands, names))
    again, place = _repeated(points, there & ~stands)
    if place is not None:
        notes.append(_not_seen(", ".join(f"{number:.7g}" for number in place), again, names))
    return there & ~stands & ~again, notes


def _not_seen(value: str, where: NDArray[np.bool_], names: Sequence[str]) -> str:
    which = [names[int(column)] or "one without a name" for column in np.flatnonzero(where.any(axis=0)).tolist()]
    return f"{value} is taken as not seen ({list_names(which)})"


def _repeated(points: Array, visible: NDArray[np.bool_]) -> tuple[NDArray[np.bool_], Array | None]:
    """Where one exact place stands for what was not seen, such as -1, -1, -1; and that place, None if none does.

    It is where two markers that move apart were said to be, again and again; or thrice the same whole number, off the
    path of a marker.
    """
    nowhere = np.zeros_like(visible)
    alike = visible & (points == points[..., :1]).all(-1)
    again = visible.copy()
    again[1:] &= (points[1:] == points[:-1]).all(-1)
    again[:1] = False
    places, counts = np.unique(points[alike | again][:MOST], axis=0, return_counts=True)
    for place in places[np.argsort(-counts, kind="stable")[:CANDIDATES]]:
        here = visible & (points == place).all(-1)
        moving = np.flatnonzero(here.any(axis=0) & (visible & ~here).any(axis=0))
        if here.sum() >= OFTEN and _is_nowhere(points, here, visible, moving.tolist(), place):
            return here, place
    return nowhere, None


def _is_nowhere(
    points: Array, here: NDArray[np.bool_], visible: NDArray[np.bool_], moving: Sequence[int], place: Array
) -> bool:
    if any(not np.array_equal(points[:, moving[0]], points[:, column], equal_nan=True) for column in moving[1:]):
        return True
    if not moving or len(set(place.tolist())) > 1 or place[0] != np.round(place[0]):
        return False
    others = points[(visible & ~here)[:, moving[0]], moving[0]]
    return bool(((place < others.min(axis=0)) | (place > others.max(axis=0))).any())


@dataclass(frozen=True)
class MarkerColumns:
    """Which of a file's points are markers of the person, and what they are called."""

    names: tuple[str, ...]
    columns: list[int]
    notes: tuple[str, ...]


def select_markers(
    names: Sequence[str], visible: NDArray[np.bool_], source: str, subject: str | None = None
) -> MarkerColumns:
    """The markers by name, without the subject that stands before a colon ("S01:LASI").

    Left out, and named: points without a name, the shorter of two markers of one name, other people than `subject`.
    Two subjects are two people where both have a marker of one name, or both have FEWEST markers. `subject` "" is who
    has none.
    ValueError for two people of whom none is chosen, and for an unknown one.
    """
    notes = []
    chosen_columns = [column for column, name in enumerate(names) if name.strip() and not _nameless(name)]
    if len(chosen_columns) < len(names):
        notes.append(f"{_count(len(names) - len(chosen_columns), 'point')} without a name left out")
    split = {column: names[column].rpartition(":") for column in chosen_columns}
    people = dict.fromkeys(split[column][0].strip() for column in chosen_columns)
    chosen = _person([*people], split, visible, source, subject)
    joined = [*dict.fromkeys(w for c, (who, _, _) in split.items() if (w := who.strip()) and visible[:, c].any())]
    if chosen is None and len(joined) > 1:
        notes.append(f"the markers of {list_names(joined)} are taken as one person's (`subject`: those of one)")
    if chosen is not None:
        own = {split[column][2].strip() for column in chosen_columns if split[column][0].strip() == chosen}
        nobodys = {split[column][2].strip() for column in chosen_columns if not split[column][0].strip()}
        with_him = {chosen} if own & nobodys else {"", chosen}  # names without a person are another one's, or his too
        others = [column for column in chosen_columns if split[column][0].strip() not in with_him]
        chosen_columns = [column for column in chosen_columns if split[column][0].strip() in with_him]
        if others:
            of = ", ".join(dict.fromkeys(split[column][0].strip() or NO_SUBJECT for column in others))
            notes.append(f"the markers of {chosen or NO_SUBJECT} are taken, those of {of} left out ({len(others)})")
    best: dict[str, int] = {}
    twice = []
    for column in chosen_columns:
        name = split[column][2].strip()
        if name in best:
            twice.append(name)
        if name not in best or visible[:, column].sum() > visible[:, best[name]].sum():
            best[name] = column
    if twice:
        of = list_names([*dict.fromkeys(twice)])
        notes.append(f"more than one marker is called {of}: of each the one that was seen the longest is taken")
    return MarkerColumns(tuple(best), list(best.values()), tuple(notes))


def _nameless(name: str) -> bool:
    return NAMELESS.fullmatch(name.rpartition(":")[2].strip()) is not None


def _person(
    people: list[str],
    split: dict[int, tuple[str, str, str]],
    visible: NDArray[np.bool_],
    source: str,
    subject: str | None,
) -> str | None:
    """The chosen subject; None where all the markers can be of one person."""
    if subject is not None:
        spellings = {person.lower(): person for person in people}
        wanted = subject.strip().rstrip(":").lower()
        if wanted not in spellings or not any(people):
            have = [person or NO_SUBJECT for person in people]
            expected = f"one of {', '.join(have)}" if any(people) else "none, for no marker has one"
            raise ValueError(f"{source}: subject: expected {expected}, got {subject!r}")
        return spellings[wanted]
    markers: dict[str, set[str]] = {person: set() for person in people}
    shown, of_marker = dict.fromkeys(people, False), dict[str, list[str]]()
    there = {*np.flatnonzero(visible.any(axis=0)).tolist()}
    for column, (person, _, marker) in split.items():
        person, marker = person.strip(), marker.strip()
        if marker not in markers[person]:
            of_marker.setdefault(marker, []).append(person)
        markers[person].add(marker)
        shown[person] |= column in there
    shared = [[person for person in each if shown[person]] for each in of_marker.values() if len(each) > 1]
    rivals = {person for each in shared if len(each) > 1 for person in each}
    if not rivals:
        large = {p for p in people if p and shown[p] and len(markers[p]) >= FEWEST_OF_A_PERSON}
        rivals = large if len(large) > 1 else rivals
    if not rivals:
        hidden = {person for each in of_marker.values() if not all(map(shown.get, each)) for person in each}
        return next((person for person in people if person and shown[person] and person in hidden), None)
    first, *more = [person for person in people if person in rivals]
    of = [f"{person or NO_SUBJECT} ({_count(len(markers[person]), 'marker')})" for person in [first, *more]]
    one = first or more[0]
    raise ValueError(f"{source}: two people in it, {_and(of)}: say which one (`subject={one!r}`)")


def _and(people: Sequence[str], most: int = 4) -> str:
    return " and ".join([*people[:most], *([f"{len(people) - most} more"] if len(people) > most else [])])


def _scale(unit: str | float, points: Array, source: str) -> float:
    """Metres per unit of length."""
    if not isinstance(unit, str):
        return float(unit)
    if unit:
        scale = metres(unit)
        if scale is None:
            raise ValueError(f"{source}: units: expected one of {', '.join(METRES)}, got {unit!r}")
        return scale
    return METRES[likely_unit(points)]


def likely_unit(points: Array) -> str:
    """The unit of points (n, 3) of a person, where a file does not say it: nobody's are LARGEST metres apart."""
    return "mm" if np.ptp(points, axis=0).max() > LARGEST else "m"


def unit_note(unit: str | float) -> str:
    """The note for a file that does not state its unit."""
    return f"its unit of length is not given: taken as {unit} (`units`)"


def _count(number: int, what: str) -> str:
    return f"{number} {what}" + ("" if number == 1 else "s")


def list_names(names: Sequence[str], most: int = 6) -> str:
    """The first of the names, and how many more there are."""
    return ", ".join(names[:most]) + (f" and {len(names) - most} more" if len(names) > most else "")


def alphanumeric(name: str) -> str:
    """The letters and digits of a name alone, lower case."""
    return re.sub(r"[\W_]", "", name).lower()
