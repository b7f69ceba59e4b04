"""Data sets with one file per sequence: read on demand, checked by a sample."""

from __future__ import annotations

import os
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import lru_cache, partial
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from . import check
from .frames import Frames, Rows
from .joined import Joined, concatenate

KEPT = 4  # sequences that stay in memory, because rows are mostly read in order
SAMPLED = 16  # sequences, and frames of each, that are checked
ENOUGH = 8  # sequences: in so many not everybody lies, so the direction from feet to head shows where up is


@dataclass(frozen=True)
class OnDemand:
    """A sequence of `length` frames that is read when some of them are asked for."""

    length: int
    read: Callable[[], Frames]

    def __len__(self) -> int:
        return self.length

    def __getitem__(self, rows: Rows) -> Frames:
        return self.read()[rows]


def recordings(path: str | os.PathLike[str], suffix: str) -> list[Path]:
    """The file `path`, or all files with this suffix, in capitals or not, anywhere below the folder.

    ValueError where there is none.
    """
    place = Path(path)
    below = place.glob("**/*") if place.is_dir() else [place]
    files = sorted(each for each in below if each == place or (each.suffix.lower() == suffix and each.is_file()))
    if not files or not files[0].is_file():
        raise ValueError(
            f"{path}: expected a {suffix} file or a folder of them, {'none in it' if not files else 'not there'}"
        )
    return files


def sequences(lengths: Sequence[int], read: Callable[[int], Frames], source: str | os.PathLike[str]) -> Joined:
    """One after the other; `read(i)` gives all the `lengths[i]` frames of the i-th.

    ValueError, naming `source`, if there is no frame at all.
    """
    if not sum(lengths):
        raise ValueError(f"{source}: no frame at all: is the download complete?")
    cached = lru_cache(KEPT)(read)
    return Joined([OnDemand(length, partial(cached, index)) for index, length in enumerate(lengths)])


def fill_missing(parts: Sequence[Frames]) -> list[Frames]:
    """The parts with NaN for measurements that only other parts have, and the same number of force plates in each."""
    plates = max((part.forces.shape[1] for part in parts if part.forces is not None), default=0)
    return [_with_nothing(part, parts, plates) for part in parts]


def _with_nothing(part: Frames, parts: Sequence[Frames], plates: int) -> Frames:
    lacking: dict[str, NDArray[np.floating]] = {
        name: np.full((len(part), 3), np.nan)
        for name in ("center_of_mass", "center_of_pressure")
        if getattr(part, name) is None and any(getattr(other, name) is not None for other in parts)
    }
    if plates:
        forces = np.full((len(part), plates, 3), np.nan)
        if part.forces is not None:
            forces[:, : part.forces.shape[1]] = part.forces
        lacking["forces"] = forces
    return replace(part, **lacking)


def require_plausible(path: str | os.PathLike[str], data: Joined) -> Joined:
    """`data`, if a sample of it has plausible units and, where it has enough sequences to tell, axes and ground."""
    chosen = [data.parts[index] for index in check.evenly(len(data.parts), SAMPLED) if len(data.parts[index])]
    frames = concatenate([part[check.evenly(len(part), SAMPLED)] for part in chosen])
    check.raise_if_wrong(
        Path(path), check.check_frames(frames if len(chosen) >= ENOUGH else replace(frames, ground=None))
    )
    return data


def require_plausible_units(file: Path, frames: Frames) -> Frames:
    """The frames of one sequence, if their units can be right. Its axes do not tell: its person may lie throughout."""
    check.raise_if_wrong(file, check.check_frames(replace(check.sample(frames), ground=None)))
    return frames


def check_sequences(parts: Sequence[tuple[str, Callable[[], Frames]]]) -> list[check.Finding]:
    """Findings about sequences that are read one by one: what is wrong with each, and checks of a sample of all."""
    findings, samples = [], []
    for index, (name, read) in enumerate(parts):
        try:
            frames = read()
        except (ValueError, ImportError) as error:
            findings.append(check.Finding("wrong", str(error)))
            continue
        sample = frames[check.evenly(len(frames), check.SAMPLE)]
        for each in check.check_frames(replace(sample, ground=None)):
            if each.level != "ok":
                findings.append(check.Finding(each.level, f"{name}: {each.what}", each.advice))
        if index in check.evenly(len(parts), SAMPLED**2):
            samples.append(frames[check.evenly(len(frames), SAMPLED)])
    try:
        return findings + (check.check_frames(concatenate(samples)) if samples else [])
    except ValueError as error:  # they have other joints, or only some have a ground
        return [*findings, check.Finding("missing", str(error))]


def check_recording(name: str, frames: Frames) -> list[check.Finding]:
    """Findings about one recording, with its name."""
    findings = check.check_frames(check.sample(frames))
    return [check.Finding(each.level, f"{name}: {each.what}", each.advice) for each in findings]


def frame_names(name: str, count: int) -> NDArray[np.str_]:
    """Names of the frames of a sequence: "name/00000", "name/00001", ..."""
    return np.array([f"{name}/{number:05d}" for number in range(count)], np.str_)
