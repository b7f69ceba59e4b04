"""The work of `ipman validate`: fit each recording, compare it with what was measured, write what came out."""

from __future__ import annotations

import json
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from ..body import safe_npz
from ..data.tracks import Tracks
from ..files import write_whole
from ..fitting import config, markers
from ..fitting.recorded import FEWEST
from ..validation import Comparison, computed, figures, measured, pictures, report
from ..validation.folder import Trial, find
from . import console
from .errors import FileError
from .fit_outputs import npz
from .fit_recordings import Pace, Recording, kept
from .fit_run import Settings
from .parameters import read_npz

Record = dict[str, Any]


@dataclass(frozen=True)
class Plan:
    """What one command is to do. `person`: the name of the recording whose shape is kept."""

    folder: Path
    output: Path
    trials: list[Trial]
    settings: Settings
    person: str | None
    rate: float
    resume: bool
    notes: list[str]
    unreadable: dict[Path, str]


def plan(folder: Path, output: Path, model: str, person: str, rate: float, resume: bool) -> Plan:
    """ValueError for a folder without recordings to compare, a recording or body model that is not there."""
    import ipman_rs as ip

    trials, notes, unreadable = find(folder, measured.kind_of, measured.has_plates)
    still = next((trial.name for trial in trials if trial.still), None)
    chosen = {"auto": still, "none": None}.get(person, person)
    names = [trial.name for trial in trials]
    if chosen is not None and chosen not in names:
        raise ValueError(f"--person: expected auto, none or one of {', '.join(names)}, got {person!r}")
    trials.sort(key=lambda trial: trial.name != chosen)  # their shape is needed first
    ip.load_body(model)  # before anything is fitted
    return Plan(
        folder, output, trials, Settings(config.load("markers"), model), chosen, rate, resume, notes, unreadable
    )


def run(plan: Plan) -> tuple[list[Record], list[str], list[FileError]]:
    """The figures of every recording that could be compared, what was assumed, and those that failed."""
    records: list[Record] = []
    notes, failures = [*plan.notes], [FileError(path, what) for path, what in plan.unreadable.items()]
    person = None
    for trial in plan.trials:
        try:
            tracks = _tracks(trial)
            every = max(1, round((tracks.rate or 1.0) / plan.rate))
            recording = Recording(trial.name, str(trial.markers), [trial.markers])
            fit = kept(recording, plan.settings, Pace(every), plan.output, plan.resume, person)
            if trial.name == plan.person:
                person = trial.name
            if fit["unknown"]:
                notes.append(f"{trial.name}: markers without a known place, not used: {', '.join(fit['unknown'])}")
            records.append(_compared(plan, trial, tracks, fit))
        except FileError as error:
            failures.append(error)
            if trial.name == plan.person:
                notes.append(f"{trial.name} could not be compared: the others found their shapes themselves")
    return records, notes, failures


def _tracks(trial: Trial) -> Tracks:
    try:
        return markers.read(trial.markers)
    except (ValueError, ImportError) as error:
        raise FileError(trial.markers, str(error)) from error


def _compared(plan: Plan, trial: Trial, tracks: Tracks, fit: Record) -> Record:
    """The figures of a fitted recording; its series and pictures are written."""
    folder = plan.output / trial.name
    stored = read_npz(folder / f"{trial.name}.npz", plan.settings.model)
    times = safe_npz.read(folder / f"{trial.name}.npz", "times")
    bodies, template = stored.vertices, stored.template
    plates, reference = _measured(trial, times)
    with console.progress(f"measuring {trial.name}", len(times)) as step:
        found = computed(bodies, template, plates, step.to)
    rows = np.abs(tracks.times[:, None] - times).argmin(axis=0)
    confidence = tracks.confidence[rows]
    enough = confidence.sum(axis=1) >= FEWEST
    try:
        one = Comparison(trial.name, times, found, plates, reference, enough)
    except ValueError as error:
        raise FileError(trial.com or trial.forces or trial.markers, str(error)) from error
    points = np.where(confidence[..., None] > 0, tracks.points[rows], np.nan)
    series = report.series(one)
    with console.progress(f"drawing {trial.name}", 3) as step:
        files = {"series.npz": npz(series), "series.csv": report.table(series).encode()}
        for name, draw in (
            ("pressure.png", lambda: pictures.pressure_map(one, bodies, template)),
            ("over_time.png", lambda: pictures.over_time(one)),
            ("bodies.png", lambda: pictures.people(one, bodies, stored.faces, points)),
        ):
            files[name] = draw()
            step.one()
    for name, content in files.items():
        write_whole(folder / name, content)
    told = {"shape_from": fit["shape_from"], "markers": fit["mean_marker_error_m"], "converged": fit["converged"]}
    return {**figures(one), "body": plan.settings.model, "fit": told, "files": sorted(files)}


def _measured(trial: Trial, times: np.ndarray):
    """The plates and the reference of a recording at these times."""
    plates = reference = None
    try:
        if trial.forces is not None:
            plates = measured.plates(trial.forces).at(times)
    except (ValueError, ImportError) as error:
        raise FileError(trial.forces or trial.markers, str(error)) from error
    try:
        if trial.com is not None:
            reference = measured.center_of_mass(trial.com, times)
    except ValueError as error:
        raise FileError(trial.com or trial.markers, str(error)) from error
    return plates, reference


def write(plan: Plan, records: list[Record], notes: list[str], failures: list[FileError]) -> Path:
    """The page and the numbers of all recordings. Raises OSError."""
    plan.output.mkdir(parents=True, exist_ok=True)
    drawn = [f"{one['name']}/{name}" for one in records for name in one["files"] if name.endswith(".png")]
    told = [*notes, *(f"not compared: {failure}" for failure in failures)]
    page = plan.output / "validation.md"
    write_whole(page, report.markdown(records, plan.folder.resolve().name, told, drawn).encode())
    whole = {"folder": str(plan.folder), "body": plan.settings.model, "person": plan.person, "notes": told}
    content = json.dumps({**whole, "recordings": records}, allow_nan=False, ensure_ascii=False, indent=1)
    write_whole(plan.output / "validation.json", f"{content}\n".encode())
    return page.resolve()
