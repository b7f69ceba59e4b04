"""The trials in a folder: recordings of markers with the forces and centres of mass that belong to them.

`data.pairing` decides by names and folders which files belong together; the columns of a file decide what it holds. A
`.c3d` with force plates brings its own forces, and one with Plug-in Gait's CentreOfMass its own centre of mass.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

from ..data import external_loads, pairing
from ..data.external_loads import ExternalLoads

MARKERS = (".trc", ".c3d")
TABLES = (".mot", ".sto", ".csv")


@dataclass(frozen=True)
class Trial:
    """A recording: the files of its markers, forces and centre of mass (None: not measured).

    `owner`: the folders that say which person it is of. `loads`: in which columns the forces are, where a file says so.
    """

    name: str
    markers: Path
    forces: Path | None = None
    com: Path | None = None
    owner: tuple[str, ...] = ()
    loads: ExternalLoads | None = None

    @property
    def still(self) -> bool:
        """Whether its name says that somebody stands still."""
        return pairing.is_static(self.name)


@dataclass(frozen=True)
class Kinds:
    """What files hold. `table`: "forces", "com", or None and why it is neither, ValueError if it cannot be read;
    `plates` and `com`: whether a `.c3d` has force plates, and a centre of mass."""

    table: Callable[[Path], tuple[str | None, str]]
    plates: Callable[[Path], bool]
    com: Callable[[Path], bool]


def find_trials(
    folder: Path, kinds: Kinds, apart: Path | None = None
) -> tuple[list[Trial], list[str], dict[Path, str]]:
    """The recordings of a folder and those below it, by name, those of standing still first; what was not used, and
    why; and what is wrong with files that could not be read.

    `apart`: a folder that is not of the measurements, such as that of outputs. ValueError, saying what was expected, if
    the folder is none, has no markers, or nothing was measured beside them.
    """
    if not folder.is_dir():
        raise ValueError(
            f"{folder}: expected a folder of recordings, {'got a file' if folder.exists() else 'not there'}"
        )
    files = _files(folder, apart)
    markers, notes = _drop_copies([path for path in files if path.suffix.lower() in MARKERS], folder)
    if not markers:
        raise ValueError(f"{folder}: expected files of markers ({', '.join(MARKERS)}), got {_listed(files, folder)}")
    own = [path for path in markers if path.suffix.lower() == ".c3d"]
    tables: dict[Path, str] = {}
    others: dict[str, list[str]] = {}
    unreadable: dict[Path, str] = {}
    loads, aliases, wrong = external_loads.find(files)
    for path in files:
        if path.suffix.lower() not in TABLES:
            continue
        try:
            kind, why = kinds.table(path)
        except ValueError as error:
            unreadable[path] = str(error)
            continue
        kind = "forces" if path in loads else kind
        if kind is None:
            others.setdefault(why, []).append(path.relative_to(folder).as_posix())
        else:
            tables[path] = kind
    paired = pairing.pair(markers, tables, folder, [path for path in own if kinds.plates(path)], aliases)
    notes += [*wrong, *paired.notes]
    notes += [f"{path.relative_to(folder).as_posix()}: not used, for {why}" for path, why in paired.left.items()]
    notes += [f"{', '.join(names)}: not used, for {why}" for why, names in others.items()]
    trials = []
    for name, path in zip(pairing.names(markers, folder), markers, strict=True):
        forces, com = paired.forces.get(path), paired.com.get(path)
        if com is None and path in own and kinds.com(path):
            com = path
        owner = pairing.ParsedPath.of(path, folder).owner
        trials.append(Trial(name, path, forces, com, owner, None if forces is None else loads.get(forces)))
    if not any(trial.forces or trial.com for trial in trials):
        raise ValueError(
            f"{folder}: markers of {', '.join(trial.name for trial in trials)}, but nothing to compare with; expected "
            f"forces (such as {trials[0].name}_grf.mot, or plates in a .c3d) or centres of mass (such as "
            f"{trials[0].name}_com.sto, with columns center_of_mass_X, Y, Z)"
            + "".join(f"; {what}" for what in [*notes, *unreadable.values()])
        )
    return sorted(trials, key=lambda trial: (trial.owner, not trial.still, trial.name)), notes, unreadable


def _files(folder: Path, apart: Path | None) -> list[Path]:
    """All but hidden ones."""
    away = None if apart is None else apart.resolve()
    files = []
    for path in sorted(folder.rglob("*")):
        hidden = any(part.startswith(".") for part in path.relative_to(folder).parts)
        if hidden or not path.is_file() or (away is not None and path.resolve().is_relative_to(away)):
            continue
        files.append(path)
    return files


def _drop_copies(markers: Sequence[Path], root: Path) -> tuple[list[Path], list[str]]:
    """Without the `.trc` that lies beside a `.c3d` of the same name: it was made of it; and which those are."""
    whole = {path.with_suffix("") for path in markers if path.suffix.lower() == ".c3d"}
    twice = [path for path in markers if path.suffix.lower() != ".c3d" and path.with_suffix("") in whole]
    notes = [
        f"{path.relative_to(root).as_posix()}: not used, for {path.stem}.c3d has the same name; take away one of them"
        for path in twice
    ]
    return [path for path in markers if path not in twice], notes


def _listed(files: Sequence[Path], folder: Path) -> str:
    names = [path.relative_to(folder).as_posix() for path in files[:5]]
    return ", ".join(names) + (" and more" if len(files) > 5 else "") if names else "an empty folder"
