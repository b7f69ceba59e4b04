"""Recordings for `ipman fit`: a marker file, or keypoints frame by frame, become one body over time."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from ...data import plausibility
from ...files import read_json, safe_npz
from ...files.errors import FileError
from ...progress import Progress, silent
from .outputs import RECORD, read_finished, write_files

if TYPE_CHECKING:
    from ...data.markers import Point
    from ...study import Study
    from ..fit import Fit
    from ..marker_fit import MarkerFit, Person
    from .items import Item
    from .options import FitOptions


MAX_FRAME_FLAGS = 3  # flags of single frames in the record of a recording


@dataclass
class MotionInput:
    """One person over time: a marker file, or the frames of keypoint files or photos in their order."""

    name: str
    source: str
    paths: list[Path]
    frames: list[Item] | None = None  # None: markers


@dataclass(frozen=True)
class Pace:
    """every: fit each n-th frame. fps: frames a second of keypoints, which do not say."""

    every: int = 1
    fps: float = 30.0

    def check(self) -> None:
        """ValueError for what is no pace."""
        if self.every < 1:
            raise ValueError(f"every: expected 1 or more, got {self.every}")
        if not 0 < self.fps < float("inf"):
            raise ValueError(f"fps: expected more than 0, got {self.fps}")


@dataclass(frozen=True, eq=False)
class FittedRecording:
    """One finished recording: its file, the arrays in it (as `ipman analyze` reads them), and the record of its
    fit.json."""

    path: Path
    arrays: dict[str, np.ndarray]
    record: dict[str, Any]


def fit_recording(
    recording: MotionInput,
    options: FitOptions,
    pace: Pace,
    output: Path,
    resume: bool = False,
    person: str | None = None,
    progress: Progress = silent,
) -> FittedRecording:
    """Fit a recording and write its folder in `output`, or read it where `resume` finds the same input and options.

    `person`: the name of a marker recording that is in `output`, whose shape and places of markers this one keeps.
    Raises FileError, and OSError where nothing can be written.
    """
    folder = output / recording.name
    path = folder / f"{recording.name}.npz"
    of_person = None if person is None else _record(output / person)
    identity = _identity(recording, options, pace, None if of_person is None else of_person["identity"])
    finished = read_finished(path, identity) if resume else None
    if finished is not None:
        return FittedRecording(path, *finished)
    try:
        shape = None if person is None else person_of(output / person)
        fit, arrays, record, rate = (
            _fit_markers(recording, options, pace, shape, progress)
            if recording.frames is None
            else _fit_frames(recording, options, pace, progress)
        )
    except ValueError as error:
        raise FileError(recording.paths[0], str(error).removeprefix(f"{recording.paths[0]}: ")) from error
    arrays = {**_arrays(fit, rate), **arrays}
    record = {"name": recording.name, "source": recording.source, **_stages(fit), **record}
    record |= {"preset": _preset(recording, options), "shape_from": person or "itself", "identity": identity}
    return FittedRecording(path, arrays, write_files(folder, {path.name: arrays}, record))


def person_of(folder: Path) -> Person:
    """Whose marker recording is kept in a folder."""
    import torch

    from ..marker_fit import Person

    record = _record(folder)
    sites = {name: _point(site) for name, site in record["sites"].items()}
    return Person(torch.from_numpy(safe_npz.read(folder / f"{record['name']}.npz", "betas").copy()), sites)


def _point(site: Any) -> Point:
    """A marker's place, as a record has it."""
    from ...data.markers import Inner, Site

    if isinstance(site, str):
        return site
    if "joint" in site:
        by_betas = tuple(tuple(each) for each in site["by_betas"])
        return Inner(site["joint"], tuple(site["place"]), by_betas, site["spread"])
    return Site(site["vertex"], tuple(site["shift"]), site["spread"])


def _record(folder: Path) -> dict[str, Any]:
    return read_json(folder / RECORD)


def _preset(recording: MotionInput, options: FitOptions) -> str:
    """Markers have a preset of their own, unless another was asked for."""
    return "markers" if recording.frames is None and options.config.name == "fast" else options.config.name


Fitted = tuple[
    "Fit", dict[str, np.ndarray], dict[str, Any], float
]  # with further arrays, the record, frames per second


def _fit_markers(
    recording: MotionInput, options: FitOptions, pace: Pace, person: Person | None, progress: Progress
) -> Fitted:
    import ipman_rs.torch as ipt

    from ...data import markers
    from ...data.markers import own
    from ...data.markers.plausibility import check_skin, check_tracks
    from .. import config, marker_fit

    preset, path = _preset(recording, options), recording.paths[0]
    chosen = config.load(preset) if preset == "markers" else options.config
    body = ipt.BodyModel(options.model)
    names = None if options.markers is None else own.read(options.markers, body.body)
    tracks = markers.read(path, options.up, options.subject, options.units, options.rate)
    findings = check_tracks(tracks, names, options.up is not None, options.ground or 0.0)
    flags = plausibility.admit(path, findings, options.force)
    count = len(range(0, len(tracks), pace.every))
    with progress(f"fitting {recording.name}", count) as step:
        fitted = marker_fit.fit_tracks(
            body, tracks, chosen, every=pace.every, ground=options.ground or 0.0, person=person, own=names,
            progress=lambda _stage, done: step.to(min(done, count)),
        )  # fmt: skip
    findings, distances = marker_fit.check_fit(fitted), fitted.skin_distances
    flags = (*flags, *plausibility.admit(path, [*findings, *check_skin(distances)], options.force))
    errors = fitted.errors
    by_marker = {name: _mean(column) for name, column in zip(fitted.tracks.names, errors.T, strict=True)}
    sites = {name: site if isinstance(site, str) else asdict(site) for name, site in fitted.sites.items()}
    record = {"mean_marker_error_m": _mean(errors), "marker_errors_m": by_marker, "skin_distances_m": distances}
    record |= {"unknown": [*fitted.unknown], "unseen": [*fitted.unseen], "flags": [*flags]}
    notes = [*tracks.notes, *_own_notes(names, tracks.names, options), *_marker_notes(fitted, options)]
    record |= {"notes": notes, "sites": sites}
    if any(finding.level == "wrong" for finding in findings):
        record["converged"] = False
    return fitted.fit, {"times": fitted.tracks.times}, record, fitted.tracks.rate or 1.0


def _own_notes(own: Mapping[str, object] | None, names: Sequence[str], options: FitOptions) -> list[str]:
    """Which of the user's names of markers no marker of the recording has."""
    from ...data.markers.names import unmatched

    none = unmatched(names, own or {})
    if not none:
        return []
    more = f" and {len(none) - 8} more" if len(none) > 8 else ""
    return [f"no marker is called {', '.join(none[:8])}{more}, as {options.markers} has it (`markers`)"]


def _marker_notes(fitted: MarkerFit, options: FitOptions) -> list[str]:
    """What was done with the markers that is not odd."""
    notes = []
    if options.up is not None:
        axis = ", ".join(f"{number:g}" for number in options.up)
        notes.append(f"up: ({axis}) of the file's axes, turned to y: the bodies are y up")
    if fitted.unseen:
        notes.append(f"{len(fitted.unseen)} markers of the file were never seen: {', '.join(fitted.unseen)}")
    usual = [away for name, away in fitted.skin_distances.items()]
    if usual:
        middle = 1e3 * float(np.median(usual))
        notes.append(f"markers: {middle:.0f} mm from the skin in the median, 7 to 15 is usual (all in fit.json)")
    return notes


def _mean(errors: np.ndarray) -> float | None:
    """The mean of what is known."""
    known = errors[np.isfinite(errors)]
    return float(known.mean()) if len(known) else None


def _fit_frames(recording: MotionInput, options: FitOptions, pace: Pace, progress: Progress) -> Fitted:
    import ipman_rs.torch as ipt

    from ...data.keypoints.detections import join
    from .. import start
    from ..sequence import fit_sequence
    from .items import detect

    assert recording.frames is not None
    items, left_out = recording.frames[:: pace.every], []
    with progress(f"reading {recording.name}", len(items)) as step:
        for item in items:
            try:
                if item.detections is None:
                    detect(item)
            except FileError as error:
                left_out.append(f"{item.source}: {error.what}")
            step.one()
    frames = [item.detections for item in items if item.detections is not None]
    if not frames:
        raise ValueError(f"nobody was found in any of {len(items)} frames; first of all: {left_out[0]}")
    model = ipt.BodyModel(options.model)
    presented_body = options.presented(model.body)
    problem = options.problem(model, join(frames), presented_body)
    rate = pace.fps / pace.every
    with progress(f"fitting {recording.name}", len(frames)) as step:
        problem, variables = start.initial_state(problem, options.config.start)
        fitted = fit_sequence(
            problem, variables, options.config, rate=rate, progress=lambda _stage, done: step.to(min(done, len(frames)))
        )
    assert problem.points is not None
    median = (fitted.candidate.projected - problem.points).norm(dim=-1).median()
    notes = list(dict.fromkeys(note for item in items for note in item.notes))
    flags = list(dict.fromkeys(flag for item in items for flag in item.flags))
    if len(flags) > MAX_FRAME_FLAGS:
        flags = [*flags[:MAX_FRAME_FLAGS], f"{len(flags) - MAX_FRAME_FLAGS} more such flags of frames"]
    record: dict[str, Any] = {"frames_left_out": left_out, "median_error_px": _number(median)}
    record |= {"notes": notes, "flags": flags}
    if presented_body is not None:
        record |= {"presented": presented_body.record(model.body), "notes": [*notes, *presented_body.notes]}
    return fitted, {}, record, rate


def _stages(fit: Fit) -> dict[str, Any]:
    stages = [
        {
            "name": stage.name,
            "reason": stage.reasons[0],
            "iterations": int(stage.iterations[0]),
            "terms": {name: _number(cost.mean()) for name, cost in stage.terms.items()},
        }
        for stage in fit.stages
    ]
    return {"converged": bool(fit.converged.all()), "stages": stages}


def _arrays(fit: Fit, rate: float) -> dict[str, np.ndarray]:
    """Parameters over time, as `ipman analyze` reads them."""
    from ..result import parameters

    body = fit.problem.body.body
    arrays = parameters(body, fit.variables)
    arrays |= {"betas": arrays["betas"][:1], "mocap_frame_rate": np.array(rate), "model": np.array(body.name)}
    if fit.problem.ground is not None:
        arrays["ground_height"] = fit.problem.ground.height[:1].numpy()
    return arrays


def study_of(fitted: FittedRecording, model: str) -> Study:
    """The analysed bodies of a fitted recording; what is odd stands in the study's flags. Raises FileError."""
    from ...study.from_file import Request, analyze_file

    arrays, record = fitted.arrays, fitted.record
    ground = float(arrays["ground_height"][0]) if "ground_height" in arrays else None
    analyzed = analyze_file(fitted.path, Request(model=model, ground=ground), arrays=arrays)
    slow = plausibility.rate(float(arrays["mocap_frame_rate"]))  # some of the recording's frames are left out
    of_pace = {finding.what for finding in slow}
    flags = [flag for flag in analyzed.flags if flag.partition(";")[0] not in of_pace]
    return replace(
        analyzed,
        notes=(*analyzed.notes, *record.get("notes", ())),
        flags=(*record.get("flags", ()), *flags),
    )


def _identity(recording: MotionInput, options: FitOptions, pace: Pace, person: str | None) -> str:
    """A hash of all that a fit depends on; `person`: that of the fit whose shape is kept."""
    digest = hashlib.sha256(json.dumps([options.identity(), repr(pace), person]).encode())
    for path in recording.paths:
        digest.update(hashlib.sha256(path.read_bytes()).digest())
    return digest.hexdigest()


def _number(value: Any) -> float | None:
    return float(value) if np.isfinite(float(value)) else None


def recordings(tracks: Sequence[Path], items: Sequence[Item]) -> list[MotionInput]:
    """One of each marker file, and one of all the items, in their order."""
    motions = [MotionInput(path.stem, str(path), [path]) for path in tracks]
    if items:
        folder = items[0].path.resolve().parent
        motions.append(MotionInput(folder.name, str(folder), [item.path for item in items], [*items]))
    return motions
