"""The work of `ipman validate`: fits each recording, compares it with measurements, writes the results."""

from __future__ import annotations

import json
from collections.abc import Iterable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .. import spellings
from ..body.sites import FEWEST_POINTS
from ..data import check, markers, opensim, plausibility
from ..data.force_plates import ForcePlates
from ..data.markers import own
from ..data.markers.plausibility import check_tracks
from ..data.tracks import Tracks
from ..files import write_whole
from ..files.errors import FileError
from ..fitting import config
from ..fitting.jobs.options import FitOptions
from ..fitting.jobs.outputs import npz
from ..fitting.jobs.recordings import FittedRecording, MotionInput, Pace, fit_recording
from ..io.parameters import read_npz
from ..progress import Progress, silent
from . import MeasuredComparison, computed, figures, measured, pictures, report
from .figures import SPREAD
from .folder import Kinds, Trial, find_trials

Record = dict[str, Any]

KINDS = Kinds(measured.kind_of, measured.has_plates, measured.has_center_of_mass)
STILL = 0.01, 0.5  # m, s: whose markers move less about their means, for so long, stands still


@dataclass(frozen=True)
class Plan:
    """What one command is to do. `person`: "auto", "none", or the name of the recording whose shape is kept; `pace`:
    frames a second that are fitted; `force_unit`: of the points in files of forces, which do not say it; `force_up`:
    what points up in them, where it is not what points up in the markers."""

    folder: Path
    output: Path
    trials: list[Trial]
    settings: FitOptions
    person: str
    pace: float
    resume: bool
    notes: list[str]
    unreadable: dict[Path, str]
    force_unit: str = "m"
    force_up: tuple[float, float, float] | None = None


@dataclass(frozen=True, eq=False)
class MeasuredTrial:
    """A recording as it was measured: plates at their own times, the reference (T, 3) m at the markers'.

    `idle`: its measurements cannot be used; the recording can only give its shape to others.
    """

    trial: Trial
    tracks: Tracks
    plates: ForcePlates | None
    reference: NDArray[np.float64] | None
    flags: list[str]
    idle: bool

    @property
    def still(self) -> bool:
        """Whether the markers hardly move."""
        visible = self.tracks.confidence > 0
        paths = np.where(visible[..., None], self.tracks.points, np.nan)[:, visible.all(axis=0)]
        least, lasted = STILL[0], float(self.tracks.times[-1] - self.tracks.times[0])
        return paths.shape[1] >= FEWEST_POINTS and lasted >= STILL[1] and float(paths.std(axis=0).max()) < least


@dataclass
class RunLog:
    """Notes and failed files of a run."""

    notes: list[str] = field(default_factory=list)
    failures: list[FileError] = field(default_factory=list)


def plan(
    folder: Path,
    output: Path,
    model: str = "anny-lite",
    person: str = "auto",
    pace: float = 50.0,
    resume: bool = True,
    force_unit: str = "m",
    force_up: spellings.Axis | str | None = None,
    **of_markers: Any,
) -> Plan:
    """`pace`: frames a second to fit; `of_markers`: what `FitOptions` has of marker files.

    ValueError for a folder without recordings to compare, a recording or body model that is not there.
    """
    import ipman_rs as ip

    trials, notes, unreadable = find_trials(folder, KINDS, output)
    names = [trial.name for trial in trials]
    if person not in ("auto", "none", *names):
        raise ValueError(f"person: expected auto, none or one of {', '.join(names)}, got {person!r}")
    settings = FitOptions(config.load("markers"), model, **of_markers)
    force_up = spellings.argument("force_up", spellings.axis, force_up)
    body = ip.load_body(model)  # before anything is fitted
    if settings.markers is not None:
        own.read(settings.markers, body)
    return Plan(folder, output, trials, settings, person, pace, resume, notes, unreadable, force_unit, force_up)


def run(plan: Plan, progress: Progress = silent) -> tuple[list[Record], list[str], list[FileError]]:
    """The figures of every recording that could be compared, what was assumed, and those that failed."""
    log = RunLog([*plan.notes], [FileError(path, what) for path, what in plan.unreadable.items()])
    ready = [
        measurement for trial in plan.trials for measurement in [_read(plan, trial, log)] if measurement is not None
    ]
    records: list[Record] = []
    for owner in dict.fromkeys(measurement.trial.owner for measurement in ready):
        records += _run_person(
            plan, [measurement for measurement in ready if measurement.trial.owner == owner], log, progress
        )
    return records, log.notes, log.failures


def _run_person(plan: Plan, recordings: list[MeasuredTrial], log: RunLog, progress: Progress) -> list[Record]:
    """The figures of all recordings of one person, that of standing still first: its shape and weight are needed."""
    chosen = _trial_of_shape(plan, recordings, log)
    if all(measurement.plates is None and measurement.reference is None for measurement in recordings):
        return []
    recordings = [measurement for measurement in recordings if not measurement.idle or measurement.trial.name == chosen]
    records: list[Record] = []
    shape, weight = None, np.nan
    for measurement in sorted(
        recordings,
        key=lambda measurement: (measurement.trial.name != chosen, not (measurement.trial.still or measurement.still)),
    ):
        name = measurement.trial.name
        try:
            fit = _fit(plan, measurement, shape, progress)
            if name == chosen:
                shape = name
            records.append(_compare(plan, measurement, fit, weight, log, progress))
        except OSError:
            raise  # the output, which is that of all recordings, cannot be written
        except Exception as error:  # whatever it is, the other recordings were not the cause
            log.failures.append(error if isinstance(error, FileError) else _failure(measurement.trial, error))
            if name == chosen:
                log.notes.append(f"{name} could not be compared: the others found their shapes themselves")
            continue
        log.notes += [f"{name}: {note}" for note in fit.record["notes"] if note not in measurement.tracks.notes]
        if np.isnan(weight) and _gives_weight(records[-1]):
            weight = records[-1]["mass"]["plates"]
    return records


def _failure(trial: Trial, error: Exception) -> FileError:
    """Of a recording that could not be compared for a reason that nobody foresaw."""
    return FileError(trial.markers, f"cannot be compared: {type(error).__name__}{f': {error}' if str(error) else ''}")


def _trial_of_shape(plan: Plan, recordings: list[MeasuredTrial], log: RunLog) -> str | None:
    """The recording whose shape is kept: by its name, or because its markers hardly move."""
    names = [measurement.trial.name for measurement in recordings]
    if plan.person != "auto":
        return plan.person if plan.person in names else None
    called = [measurement.trial.name for measurement in recordings if measurement.trial.still]
    still_names = [
        measurement.trial.name
        for measurement in recordings
        if measurement.still and measurement.trial.markers.stem in measurement.trial.name
    ]
    if called or not still_names or len(names) == 1:
        return next(iter(called), None)
    log.notes.append(
        f"{still_names[0]}: its markers stand still, so its shape and places of markers are kept for the others"
    )
    return still_names[0]


def _gives_weight(record: Record) -> bool:
    """Whether a recording says what the person weighs: all of it was on plates, and nothing moved."""
    mass = record["mass"]
    quiet = record["kind"] == "quiet standing" and mass["plates"] is not None
    return quiet and mass["plates_std"] < SPREAD * mass["plates"] and not record["frames_beside_plates"]


def _read(plan: Plan, trial: Trial, log: RunLog) -> MeasuredTrial | None:
    """A recording's files, judged before anything is fitted; None, and a failure, if its markers cannot be used."""
    try:
        tracks = _tracks(plan, trial)
        flags = [*_flags(trial.markers, _marker_findings(plan, tracks), plan.settings.force)]
        log.notes += [f"{trial.name}: {note}" for note in tracks.notes]
    except FileError as error:
        log.failures.append(error)
        if trial.name == plan.person or (plan.person == "auto" and trial.still):
            log.notes.append(f"{trial.name} could not be compared: the others found their shapes themselves")
        return None
    plates = reference = None
    failed = len(log.failures)
    try:
        if trial.forces is not None:
            plates = _plates(plan, trial, tracks)
            flags += plates.notes
    except FileError as error:
        log.failures.append(error)
    try:
        if trial.com is not None:
            reference = _reference(plan, trial, tracks)
    except FileError as error:
        log.failures.append(error)
    idle = plates is None and reference is None and len(log.failures) > failed
    return MeasuredTrial(trial, tracks, plates, reference, flags, idle)


def _tracks(plan: Plan, trial: Trial) -> Tracks:
    settings = plan.settings
    try:
        return markers.read(trial.markers, settings.up, settings.subject, settings.units, settings.rate)
    except ValueError as error:
        raise FileError(trial.markers, str(error)) from error


def _marker_findings(plan: Plan, tracks: Tracks) -> list[check.Finding]:
    """Findings about the markers before they are fitted; here `rate` is another one."""
    import ipman_rs as ip

    settings = plan.settings
    names = None if settings.markers is None else own.read(settings.markers, ip.load_body(settings.model))
    return check_tracks(tracks, names, settings.up is not None)


def _flags(path: Path, findings: Iterable[check.Finding], force: bool) -> tuple[str, ...]:
    """What is odd. Raises FileError for what cannot be."""
    try:
        return plausibility.admit(path, findings, force)
    except plausibility.NoPerson as error:
        raise FileError(path, str(error)) from error


def _plates(plan: Plan, trial: Trial, tracks: Tracks) -> ForcePlates:
    """Raises FileError for plates that cannot be read, or tell nothing of this recording."""
    assert trial.forces is not None
    settings = plan.settings
    try:
        apart = plan.force_up is not None and trial.forces != trial.markers
        up = plan.force_up if apart else settings.up
        plates = measured.plates(trial.forces, up, plan.force_unit, trial.loads, settings.units)
    except (ValueError, ImportError) as error:
        raise FileError(trial.forces, str(error)) from error
    centers = plates.at(tracks.times).center()
    for each in opensim.check_loads(plates, tracks.times) or opensim.check_near_markers(
        centers, tracks, "centre of pressure"
    ):
        raise FileError(trial.forces, f"{each.what}; {each.advice}")
    return plates


def _reference(plan: Plan, trial: Trial, tracks: Tracks) -> NDArray[np.float64]:
    assert trial.com is not None
    settings = plan.settings
    try:
        centers = measured.center_of_mass(trial.com, tracks.times, settings.up, settings.subject, settings.units)
    except ValueError as error:
        raise FileError(trial.com, str(error)) from error
    if not np.isfinite(centers).any():
        first, last = tracks.times[0], tracks.times[-1]
        what = f"no centre of mass while the markers were recorded, t {first:.2f} to {last:.2f} s"
        raise FileError(trial.com, f"{what}; are both of one recording, with one clock?")
    for each in opensim.check_near_markers(centers, tracks, "centre of mass"):
        raise FileError(trial.com, f"{each.what}; {each.advice}")
    return centers


def _fit(plan: Plan, measurement: MeasuredTrial, person: str | None, progress: Progress) -> FittedRecording:
    every = max(1, round((measurement.tracks.rate or 1.0) / plan.pace))
    recording = MotionInput(measurement.trial.name, str(measurement.trial.markers), [measurement.trial.markers])
    return fit_recording(recording, plan.settings, Pace(every), plan.output, plan.resume, person, progress)


def _compare(
    plan: Plan, measurement: MeasuredTrial, fit: FittedRecording, weight: float, log: RunLog, progress: Progress
) -> Record:
    """The figures of a fitted recording, whose person weighs `weight` kg; its series and pictures are written."""
    trial = measurement.trial
    folder = plan.output / trial.name
    stored = read_npz(fit.path, plan.settings.model, arrays=fit.arrays)
    times = fit.arrays["times"]
    bodies, template = stored.vertices, stored.template
    plates = None if measurement.plates is None else measurement.plates.at(times)
    with progress(f"measuring {trial.name}", len(times)) as step:
        measures = computed(bodies, template, plates, step.to)
    rows = np.abs(measurement.tracks.times[:, None] - times).argmin(axis=0)
    confidence = measurement.tracks.confidence[rows]
    try:
        compared = MeasuredComparison(
            trial.name,
            times,
            measures,
            plates,
            None if measurement.reference is None else measurement.reference[rows],
            confidence.sum(axis=1) >= FEWEST_POINTS,
            "reference" if trial.com is None else measured.reference_name(trial.com),
            weight,
        )
    except ValueError as error:
        raise FileError(trial.com or trial.forces or trial.markers, str(error)) from error
    points = np.where(confidence[..., None] > 0, measurement.tracks.points[rows], np.nan)
    files = _draw(compared, stored, points, log, progress)
    for name, content in files.items():
        write_whole(folder / name, content)
    how = fit.record
    fitted = {"shape_from": how["shape_from"], "markers": how["mean_marker_error_m"], "converged": how["converged"]}
    record = {**figures(compared), "body": plan.settings.model, "fit": fitted, "files": sorted(files)}
    return {**record, "flags": [*dict.fromkeys([*measurement.flags, *how["flags"], *record["flags"]])]}


def _draw(
    compared: MeasuredComparison, stored: Any, points: NDArray[np.float64], log: RunLog, progress: Progress
) -> dict[str, bytes]:
    """The series and the pictures, by file name; of pictures of which there is nothing to draw, a note."""
    series = report.series(compared)
    files = {"series.npz": npz(series), "series.csv": report.table(series).encode()}
    with progress(f"drawing {compared.name}", 3) as step:
        for name, draw in (
            ("pressure.png", lambda: pictures.pressure_map(compared, stored.vertices, stored.template)),
            ("over_time.png", lambda: pictures.over_time(compared)),
            ("bodies.png", lambda: pictures.people(compared, stored.vertices, stored.faces, points)),
        ):
            try:
                files[name] = draw()
            except (ValueError, ArithmeticError) as error:
                log.notes.append(f"{compared.name}: {name} left out, it has nothing to show ({error})")
            step.one()
    return files


def write(plan: Plan, records: list[Record], notes: list[str], failures: list[FileError]) -> Path:
    """The page and the numbers of all recordings. Raises OSError."""
    plan.output.mkdir(parents=True, exist_ok=True)
    drawn = [f"{record['name']}/{name}" for record in records for name in record["files"] if name.endswith(".png")]
    all_notes = [*notes, *(f"not compared: {failure}" for failure in failures)]
    page = plan.output / "validation.md"
    write_whole(page, report.markdown(records, plan.folder.resolve().name, all_notes, drawn).encode())
    shapes = sorted({record["fit"]["shape_from"] for record in records} - {"itself"})
    person = ", ".join(shapes) or None
    whole = {"folder": str(plan.folder), "body": plan.settings.model, "person": person, "notes": all_notes}
    content = json.dumps({**whole, "recordings": records}, allow_nan=False, ensure_ascii=False, indent=1)
    write_whole(plan.output / "validation.json", f"{content}\n".encode())
    return page.resolve()
