"""Tip test and simulated falls of the bodies of one file: table, records and filmstrips of `ipman simulate`."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, fields, replace
from pathlib import Path
from typing import Any

import numpy as np

from ..analysis import PIECE
from ..body.sequence import pieces
from ..files import atomic_write, safe_names, write_whole
from ..files.errors import FileError
from ..ground import Ground
from ..jsonable import jsonable
from ..progress import Progress, silent
from ..status import Status, status_names
from ..study import Study, study
from ..study.study import evenly_spaced_frames, flagged_name
from ..view.filmstrip import draw_filmstrip
from . import FALLEN, VERDICT, Simulation, TipTest, simulate, tip_test
from .inputs import GroundedBodies

FRAMES = 6  # of a filmstrip

_UNKNOWN = Status.NON_FINITE | Status.NO_VOLUME | Status.NO_CONTACT | Status.NOT_SIMULATED


@dataclass(frozen=True)
class FallFrames:
    """The frames of one fall's filmstrip: the frame of the file, poses (T, V, 3) and the seconds of each."""

    frame: int
    study: Study
    seconds: tuple[float, ...]


@dataclass(frozen=True)
class Fall:
    """The tip tests of the T bodies of a file, their simulation (None if not requested), and the filmstrips' frames.

    names: of the bodies, where the file names them. flags: warnings about them.
    """

    path: Path
    tip: TipTest
    run: Simulation | None
    notes: Sequence[str]
    films: Sequence[FallFrames]
    names: tuple[str, ...] | None = None
    flags: tuple[str, ...] = ()

    @property
    def count(self) -> int:
        return len(self.tip.status)

    @property
    def without_verdict(self) -> str:
        """Why nothing is said about who stands; empty where it is."""
        if self.run is None or self.run.has_verdict:
            return ""
        return (
            f"no verdict at {self.run.times[-1]:.3g} s, displacement only: who stands is judged after {VERDICT:g} s "
            f"or later (`times={self.run.times[-1]:.5g},{VERDICT:g}`)"
        )

    def stands(self) -> np.ndarray | None:
        """(T,) by the simulation, or by the roll where there is none; None where the simulation ends too early."""
        if self.run is None:
            return self.tip.stands()
        return ~self.run.fell() if self.run.has_verdict else None

    def status(self) -> np.ndarray:
        return self.tip.status if self.run is None else self.run.status

    def titles(self) -> list[str]:
        titles = ["kg", "margin mm", "barrier J", "push °/s", "roll °", "nudged °"]
        if self.run is not None:
            for seconds in self.run.times:
                titles += [f"moved {seconds:.3g} s mm", f"tilt {seconds:.3g} s °"]
        return titles

    def _columns(self) -> np.ndarray:
        tip = self.tip
        columns = [
            tip.mass, 1e3 * tip.margin, tip.barrier, np.degrees(tip.push), np.degrees(tip.tilt),
            np.degrees(tip.nudged_tilt),
        ]  # fmt: skip
        if self.run is not None:
            for k in range(len(self.run.times)):
                columns += [1e3 * self.run.displacement[:, k], np.degrees(self.run.tilt[:, k])]
        return np.stack(columns)

    def rows(self) -> Iterator[tuple[str, list[str], str | None]]:
        columns, stands, status = self._columns(), self.stands(), self.status()
        for frame in range(self.count):
            own = f" {frame}" if self.names is None else f" {self.names[frame]}"
            name = flagged_name(self.path.name + ("" if self.count == 1 else own), self.flags)
            unknown = status_names(status[frame] & _UNKNOWN)
            verdict = None if stands is None else ("yes" if stands[frame] else "no")
            yield name, [_number(value) for value in columns[:, frame]], ", ".join(unknown).lower() or verdict

    def summary(self) -> tuple[str, list[str], str | None]:
        """Medians of the finite values."""
        known = (self.status() & _UNKNOWN) == 0
        if not known.any():
            return self._title(), ["–"] * len(self.titles()), None
        cells = [_number(value) for value in np.median(self._columns()[:, known], axis=1)]
        stands = self.stands()
        left_out = "" if known.all() else f" of {known.sum()}"
        share = None if stands is None else f"{100 * stands[known].mean():.0f} %{left_out}"
        return self._title(), cells, share

    def _title(self) -> str:
        return flagged_name(f"{self.path.name} ({self.count} frames)", self.flags)

    def record(self) -> dict[str, Any]:
        """Plain numbers for JSON; of more than 10,000 frames evenly spaced ones."""
        frames = evenly_spaced_frames(self.count)
        stands, status = self.stands(), self.status()
        known = (status & _UNKNOWN) == 0
        tip = {field.name: getattr(self.tip, field.name) for field in fields(TipTest) if field.name != "status"}
        listed = []
        for frame in frames:
            row: dict[str, Any] = {"frame": int(frame), "status": status_names(status[frame])}
            if self.names is not None:
                row["name"] = self.names[frame]
            row["stands"] = bool(stands[frame]) if known[frame] and stands is not None else None
            row |= {name: jsonable(column[frame]) for name, column in tip.items()}
            if self.run is not None:
                run = self.run
                row["displacement"], row["simulated_tilt"] = (
                    jsonable(run.displacement[frame]),
                    jsonable(run.tilt[frame]),
                )
            listed.append(row)
        engine = {} if self.run is None else {"engine": self.run.engine, "times": jsonable(self.run.times)}
        notes = [*self.notes, *([self.without_verdict] if self.without_verdict else [])]
        return {
            "file": str(self.path),
            "notes": notes,
            "flags": [*self.flags],
            "fallen_tilt": FALLEN,
            **engine,
            "frames": listed,
        }

    def arrays(self) -> dict[str, np.ndarray]:
        """The columns of simulation.npz: those of `TipTest` as tip_…, and those of `Simulation`."""
        arrays = {f"tip_{field.name}": getattr(self.tip, field.name) for field in fields(TipTest)}
        if self.run is not None:
            arrays |= {field.name: np.asarray(getattr(self.run, field.name)) for field in fields(Simulation)}
        if self.names is not None:
            arrays["names"] = np.array(self.names)
        return arrays


def _number(value: float) -> str:
    if not np.isfinite(value):
        return "–"
    return f"{value:.2f}" if abs(value) < 10 else f"{value:.1f}" if abs(value) < 1000 else f"{value:.0f}"


def run_falls(
    bodies: GroundedBodies,
    films: int,
    engine: str,
    shape: str,
    times: tuple[float, ...],
    step: float,
    friction: float,
    snap: bool,
    tip_only: bool,
    progress: Progress = silent,
) -> Fall:
    """Test the bodies of a file and let them go, a piece of them at a time. Raises FileError."""
    path, recording, template = bodies.path, bodies.recording, bodies.template
    try:
        options: dict[str, Any] = {"engine": engine, "shape": shape, "step": step, "friction": friction, "snap": snap}
        tips, runs, done = [], [], 0
        with progress(f"letting go {path.name}", len(recording.vertices)) as bar:
            for vertices in pieces(recording.vertices, PIECE):
                ground = _grounds(bodies.ground, slice(done, done + len(vertices)))
                tips.append(tip_test(vertices, template, ground))
                if not tip_only:
                    arguments: dict[str, Any] = {**options, "progress": lambda here, done=done: bar.to(done + here)}
                    runs.append(simulate(vertices, template, ground, times, **arguments))
                done += len(vertices)
                bar.to(done)
        result = Fall(
            path, _joined(tips), None if tip_only else _joined(runs), bodies.notes, (), bodies.names, bodies.flags
        )
        drawn = [] if tip_only else _to_draw(result, films)
        made = [
            _film(result, recording.vertices[frame], frame, template, _grounds(bodies.ground, frame), options)
            for frame in drawn
        ]
        return replace(result, films=made)
    except (ValueError, TypeError) as error:
        raise FileError(path, str(error)) from error
    except MemoryError as error:
        raise FileError(path, "needs more memory than there is; simulate fewer frames at once") from error


def _grounds(ground: Ground, frames: slice | int) -> Ground:
    """The ground of some bodies: the one of all, or theirs."""
    if ground.height.ndim == 0 and ground.normal.ndim == 1:
        return ground
    count = max(ground.height.size, len(np.atleast_2d(ground.normal)))
    normal = np.broadcast_to(ground.normal, (count, 3))
    return Ground(normal[frames], np.broadcast_to(ground.height, count)[frames])


def _joined(parts: Sequence[Any]) -> Any:
    """One result of the bodies of several; what all share is the first's."""
    shared = {"engine", "times"}
    columns = {field.name: [getattr(part, field.name) for part in parts] for field in fields(parts[0])}
    return type(parts[0])(**{
        name: values[0] if name in shared else np.concatenate(values) for name, values in columns.items()
    })  # fmt: skip


def _to_draw(result: Fall, most: int) -> list[int]:
    known = np.flatnonzero((result.status() & _UNKNOWN) == 0)
    if len(known) <= most:
        return known.tolist()
    return sorted(set(known[np.linspace(0, len(known) - 1, most).round().astype(int)].tolist()))


def _film(
    result: Fall, body: np.ndarray, frame: int, template: Any, ground: Any, options: dict[str, Any]
) -> FallFrames:
    """The fall simulated once more, with outputs in even steps."""
    assert result.run is not None
    seconds = np.linspace(0.0, result.run.times[-1], FRAMES)
    run = simulate(body, template, ground, tuple(seconds), **options)
    labels = [f"{time:.2f} s" for time in run.times]
    name = result.path.stem if result.count == 1 else f"{result.path.stem} {frame}"
    return FallFrames(frame, study(name, run.posed(body), template, ground, labels=labels), tuple(run.times.tolist()))


def write_falls(falls: Sequence[Fall], output: Path, record: str, progress: Progress = silent) -> None:
    """simulation.json of all files; simulation.npz and filmstrips of each, in folders where there are several."""
    output.mkdir(parents=True, exist_ok=True)
    write_whole(output / "simulation.json", record + "\n")
    names = safe_names([one.path.stem for one in falls])
    with progress("writing", sum(1 + len(one.films) for one in falls)) as bar:
        for one, name in zip(falls, names, strict=True):
            folder = output if len(falls) == 1 else output / name
            folder.mkdir(exist_ok=True)
            with atomic_write(folder / "simulation.npz") as file:
                np.savez_compressed(file, allow_pickle=False, **one.arrays())
            bar.one()
            for film in one.films:
                end = "" if one.count == 1 else f"_{film.frame:0{len(str(one.count))}d}"
                draw_filmstrip(film.study, folder / f"fall{end}.png")
                bar.one()
