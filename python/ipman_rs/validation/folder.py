"""What a folder of measurements holds: recordings of markers, and the forces and centres of mass that belong to them.

Files belong together by name. `squats.trc` takes its forces from a `.mot` or `.sto` whose name has `squats` in it, its
centre of mass from a `.csv` or `.sto` that has, too; the longest such name counts. What a file holds its columns say. A
`.c3d` with force plates brings its own forces. A centre of mass whose name has none of the recordings' names in it
belongs to the only recording with forces.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

MARKERS = (".trc", ".c3d")
TABLES = (".mot", ".sto", ".csv")
STILL = ("static", "stand", "neutral", "calib", "t-pose", "tpose")


@dataclass
class Trial:
    """A recording: the files of its markers, forces and centre of mass (None: not measured)."""

    name: str
    markers: Path
    forces: Path | None = None
    com: Path | None = None

    @property
    def still(self) -> bool:
        """Whether its name says that somebody stands still."""
        return any(word in self.name.lower() for word in STILL)


def find(
    folder: Path, kind_of: Callable[[Path], str | None], has_plates: Callable[[Path], bool]
) -> tuple[list[Trial], list[str], dict[Path, str]]:
    """The recordings of a folder, by name, those of standing still first; what was not used, and why; and what is wrong
    with files that could not be read.

    `kind_of` a table: "forces", "com", or None, ValueError if it cannot be read; `has_plates` of a `.c3d` file.
    ValueError, saying what was expected, if the folder is none, has no markers, or nothing was measured beside them.
    """
    if not folder.is_dir():
        raise ValueError(
            f"{folder}: expected a folder of recordings, {'got a file' if folder.exists() else 'not there'}"
        )
    files = sorted(path for path in folder.iterdir() if path.is_file() and not path.name.startswith("."))
    trials = [Trial(path.stem, path) for path in files if path.suffix.lower() in MARKERS]
    if not trials:
        raise ValueError(f"{folder}: expected files of markers ({', '.join(MARKERS)}), got {_listed(files)}")
    twice = [trial.name for index, trial in enumerate(trials) if trial.name in [other.name for other in trials[:index]]]
    if twice:
        raise ValueError(f"{folder}: two files of markers have the name {twice[0]!r}; rename one of them")
    for trial in trials:
        if trial.markers.suffix.lower() == ".c3d" and has_plates(trial.markers):
            trial.forces = trial.markers
    kinds, unreadable = {}, {}
    for path in files:
        if path.suffix.lower() in TABLES:
            try:
                kinds[path] = kind_of(path)
            except ValueError as error:
                unreadable[path] = str(error)
    notes = _tables(kinds, trials)
    if not any(trial.forces or trial.com for trial in trials):
        raise ValueError(
            f"{folder}: markers of {', '.join(trial.name for trial in trials)}, but nothing to compare with; expected "
            f"forces (such as {trials[0].name}_grf.mot, or plates in a .c3d) or centres of mass (such as "
            f"{trials[0].name}_com.sto, with columns center_of_mass_X, Y, Z)"
            + "".join(f"; {what}" for what in unreadable.values())
        )
    return sorted(trials, key=lambda trial: (not trial.still, trial.name)), notes, unreadable


def _tables(kinds: Mapping[Path, str | None], trials: Sequence[Trial]) -> list[str]:
    """Gives each table to its recording; says which are left."""
    notes, strangers = [], []
    for path, kind in kinds.items():
        trial = _named(path, trials)
        if kind is None:
            notes.append(f"{path.name}: not used, for it has neither forces nor a centre of mass")
        elif trial is None and kind == "com":
            strangers.append(path)
        elif trial is None:
            notes.append(f"{path.name}: not used, for its name has no recording's name in it")
        elif getattr(trial, kind) is None:
            setattr(trial, kind, path)
        else:
            notes.append(f"{path.name}: not used, for {trial.name} has its {kind} from {getattr(trial, kind).name}")
    for path in strangers:
        able = [trial for trial in trials if trial.forces is not None and trial.com is None]
        if len(able) == 1 and len(strangers) == 1:
            able[0].com = path
            notes.append(f"{path.name}: taken as the centre of mass of {able[0].name}, the only recording with forces")
        else:
            notes.append(f"{path.name}: not used, for its name does not say which recording it is of")
    return notes


def _named(path: Path, trials: Sequence[Trial]) -> Trial | None:
    """The recording whose name is in the file's."""
    inside = [trial for trial in trials if trial.name.lower() in path.stem.lower()]
    return max(inside, key=lambda trial: len(trial.name), default=None)


def _listed(files: Sequence[Path]) -> str:
    names = [path.name for path in files[:5]]
    return ", ".join(names) + (" and more" if len(files) > 5 else "") if names else "an empty folder"
