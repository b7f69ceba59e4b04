"""Which files belong together: recordings of markers, and the forces and centres of mass that were measured with them.

Names decide, without the words that say what is in a file: `squats.trc` and `squats_grf.mot`, `markers_walk.trc` and
`grf_walk.mot`, `MarkerData/walk.trc` and `ID/walk_grf.mot` are of one recording each, `walk1/markers.trc` and
`walk1/grf.mot` are because of their folder. Where names say nothing, the only two files of a folder belong together.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

# What laboratories call kinds of files, not recordings of people.
KINDS = frozenset(
    """marker markers markerdata mkr mkrs trc trcs mot mots sto stos c3d csv xml mocap
    grf grfs force forces forcedata forceplate forceplates plate plates fp fps external externalloads loads ground
    reaction cop analog analogs id inverse dynamics com center centre centers centres of mass
    bodykinematics bodykin kinematics ik body pos position positions global vel velocity acc acceleration
    data trial trials opensim opensimdata osim results recordings motion motions""".split()  # noqa: SIM905
)
STILL = ("static", "stand", "neutral", "calib", "t-pose", "tpose")

Words = tuple[str, ...]


def distinctive_words(name: str) -> Words:
    """The words of a name that do not describe the kind of file: "grf_walk-2" gives ("walk", "2")."""
    parted = re.sub(r"(?<=[a-z0-9])(?=[A-Z])", "_", name)
    parts = tuple(re.findall(r"[^\W_]+", parted.lower()))
    return () if name.lower() in KINDS else tuple(word for word in parts if word not in KINDS)


def is_static(name: str) -> bool:
    """Whether a name is that of a static trial."""
    return any(word in name.lower() for word in STILL)


@dataclass(frozen=True)
class ParsedPath:
    """The path of a file below `root`, parsed: `owner`, the folders that name a person, and the distinctive `words` of
    its name, or of its folder's name if its own has none."""

    path: Path
    owner: Words
    words: Words

    @classmethod
    def of(cls, path: Path, root: Path) -> ParsedPath:
        folders = [part for part in path.parent.relative_to(root).parts if distinctive_words(part)]
        own = distinctive_words(path.stem)
        if not own and folders:
            own = distinctive_words(folders.pop())
        return cls(path, tuple(folders), own)

    def rank(self, other: ParsedPath) -> int | None:
        """How well another file's name matches this recording, 0 best; None: not at all."""
        if self.words == other.words and (self.words or self.path.parent == other.path.parent):
            return 0
        if self.words and other.words and _inside(self.words, other.words):
            return 1
        stem = self.path.stem.lower()
        if distinctive_words(stem):
            begin = r"(?<!\d)" if stem[0].isdigit() else ""
            if re.search(rf"{begin}{re.escape(stem)}(?!\d)", other.path.stem.lower()):
                return 2
        return 3 if other.words and _inside(other.words, self.words) else None

    def may_share_person(self, other: ParsedPath) -> bool:
        """Whether the folders of both allow that they are of one person."""
        shared = min(len(self.owner), len(other.owner))
        return self.owner[:shared] == other.owner[:shared]


@dataclass
class Pairs:
    """`forces` and `com` of recordings, by the file of their markers; `notes` on those that names do not tell, and why
    other files are `left`, `rivals` of which belong to a recording that has another one."""

    forces: dict[Path, Path] = field(default_factory=dict)
    com: dict[Path, Path] = field(default_factory=dict)
    notes: list[str] = field(default_factory=list)
    left: dict[Path, str] = field(default_factory=dict)
    rivals: dict[Path, Path] = field(default_factory=dict)  # the file that is left: the recording's markers


def pair(
    markers: Sequence[Path],
    tables: Mapping[Path, str],
    root: Path,
    with_plates: Iterable[Path] = (),
    aliases: Mapping[Path, Path] | None = None,
) -> Pairs:
    """Gives each table, whose kind is "forces" or "com", to the recording that it belongs to.

    `given`: recordings that bring their own forces. `aliases`: a file whose name counts for a table, too.
    """
    pairs = Pairs(forces={path: path for path in with_plates})
    recordings = [ParsedPath.of(path, root) for path in markers]
    for kind, paired in (("forces", pairs.forces), ("com", pairs.com)):
        places = [ParsedPath.of(path, root) for path, what in tables.items() if what == kind]
        strangers = _by_name(places, recordings, paired, pairs, aliases or {}, root)
        _by_number(kind, strangers, places, recordings, pairs, root)
    return pairs


def _by_name(
    tables: list[ParsedPath],
    recordings: list[ParsedPath],
    paired: dict[Path, Path],
    pairs: Pairs,
    aliases: Mapping[Path, Path],
    root: Path,
) -> list[ParsedPath]:
    """Those tables of which no name says whose they are."""
    strangers: list[ParsedPath] = []
    claims: dict[Path, list[tuple[tuple[int, int, int], Path]]] = {}
    for table in tables:
        names = [table, *([ParsedPath.of(aliases[table.path], root)] if table.path in aliases else [])]
        able = sorted(
            ((rank, _steps(one.path, table.path), -len(one.path.stem)), one.path)
            for one in recordings
            if one.may_share_person(table)
            for rank in [min((r for r in map(one.rank, names) if r is not None), default=None)]
            if rank is not None
        )
        if not able:
            strangers.append(table)
        elif len(able) > 1 and able[0][0] == able[1][0]:
            which = " and ".join(_relative(path, root) for score, path in able if score == able[0][0])
            pairs.left[table.path] = f"it can belong to {which}; give it the name of one of them"
        else:
            claims.setdefault(able[0][1], []).append((able[0][0], table.path))
    for recording, claimed in claims.items():
        for _, path in sorted(claimed):
            if recording in paired:
                pairs.left[path] = (
                    f"{_relative(recording, root)} has {_what(paired, pairs)} {_source(recording, paired, root)}"
                )
                pairs.rivals[path] = recording
            else:
                paired[recording] = path
    return strangers


def _by_number(
    kind: str,
    strangers: list[ParsedPath],
    tables: list[ParsedPath],
    recordings: list[ParsedPath],
    pairs: Pairs,
    root: Path,
) -> None:
    """Gives those tables to a recording which are the only ones of their kind, in a folder or of a person."""
    paired = pairs.forces if kind == "forces" else pairs.com
    what = "forces" if kind == "forces" else "centre of mass"
    for table in strangers:
        owner, why = _only_candidate(table, tables, recordings, paired, None if kind == "forces" else pairs.forces)
        if owner is None:
            pairs.left[table.path] = (
                "its name has no recording's name in it; expected such as "
                f"{recordings[0].path.stem}_{'grf' if kind == 'forces' else 'com'}{table.path.suffix}"
            )
        else:
            paired[owner.path] = table.path
            pairs.notes.append(
                f"{_relative(table.path, root)}: taken as the {what} of {_relative(owner.path, root)}, "
                f"the only recording {why}"
            )


def _only_candidate(
    table: ParsedPath,
    tables: list[ParsedPath],
    recordings: list[ParsedPath],
    paired: dict[Path, Path],
    forces: dict[Path, Path] | None,
) -> tuple[ParsedPath | None, str]:
    """The one recording that a table can belong to: in its folder, or else among those of one person; and in words
    which one that is."""
    for near, where in (
        (lambda other: other.path.parent == table.path.parent, "in its folder"),
        (lambda other: other.may_share_person(table), "there is"),
    ):
        able = [one for one in recordings if near(one)]
        if sum(map(near, tables)) > 1 or not able:
            continue
        move = [one for one in able if not is_static(one.path.stem) and not is_static(" ".join(one.words))]
        loaded = [] if forces is None else [one for one in able if one.path in forces]
        for candidates, why in ((able, where), (loaded, "with forces"), (move, "in which nobody stands still")):
            if len(candidates) == 1 and candidates[0].path not in paired:
                return candidates[0], why
    return None, ""


def _what(paired: dict[Path, Path], pairs: Pairs) -> str:
    return "forces" if paired is pairs.forces else "a centre of mass"


def _source(recording: Path, paired: dict[Path, Path], root: Path) -> str:
    own = paired[recording] == recording
    return "of its own" if own else f"from {_relative(paired[recording], root)}"


def _inside(few: Words, many: Words) -> bool:
    return any(many[begin : begin + len(few)] == few for begin in range(len(many) - len(few) + 1))


def _steps(one: Path, other: Path) -> int:
    """The number of steps from folder to folder."""
    a, b = one.parent.parts, other.parent.parts
    shared = next((k for k, (x, y) in enumerate(zip(a, b, strict=False)) if x != y), min(len(a), len(b)))
    return len(a) + len(b) - 2 * shared


def _relative(path: Path, root: Path) -> str:
    return path.relative_to(root).as_posix()


def names(markers: Sequence[Path], root: Path) -> list[str]:
    """Names of recordings that tell them apart and can be those of folders: the file's, or its folder's where the
    file's says nothing, with folders before it where several have the same."""
    places = [ParsedPath.of(path, root) for path in markers]
    short = [
        place.path.parent.name
        if not distinctive_words(place.path.stem) and place.path.parent != root
        else place.path.stem
        for place in places
    ]
    longer = ["_".join([*place.owner, name]) for place, name in zip(places, short, strict=True)]
    whole = ["_".join(path.relative_to(root).with_suffix("").parts) for path in markers]
    ended = ["_".join([*path.relative_to(root).with_suffix("").parts, path.suffix[1:]]) for path in markers]
    unique = list(short)
    for better in (longer, whole, ended):
        unique = [name if unique.count(name) == 1 else better[row] for row, name in enumerate(unique)]
    return unique
