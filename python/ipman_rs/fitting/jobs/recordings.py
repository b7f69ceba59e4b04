"""Recordings for `ipman fit`: a marker file, or keypoints frame by frame, become one body over time."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from ...data import judge
from ...files import read_json, safe_npz
from ...files.errors import FileError
from ...progress import Progress, silent
from .outputs import RECORD, complete, write_files

if TYPE_CHECKING:
    from ...data.markers import Point
    from ...study import Study
    from ..fit import Fit
    from ..marker_fit import MarkerFit, Person
    from .items import Item
    from .run import Settings


TOLD = 3  # flags of single frames


@dataclass
class Recording:
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


def fitted(
    recording: Recording,
    settings: Settings,
    pace: Pace,
    output: Path,
    resume: bool = False,
    progress: Progress = silent,
) -> Study:
    """Fit a recording, write its folder and analyse it; what is odd stands in the study's flags. Raises FileError."""
    record = kept(recording, settings, pace, output, resume, progress=progress)
    study = _measured(recording, output / recording.name, settings)
    flags = (*record.get("flags", ()), *study.flags)
    return replace(study, notes=(*study.notes, *record.get("notes", ())), flags=flags)


def kept(
    recording: Recording,
    settings: Settings,
    pace: Pace,
    output: Path,
    resume: bool,
    person: str | None = None,
    progress: Progress = silent,
) -> dict[str, Any]:
    """The record of a recording's fit, which is in its folder: made now, or before with the same input and options.

    `person`: the name of a marker recording that is in `output`, whose shape and places of markers are kept. Raises
    FileError.
    """
    folder = output / recording.name
    known = None if person is None else _record(output / person)
    identity = _identity(recording, settings, pace, None if known is None else known["identity"])
    record = complete(folder, identity) if resume else None
    if record is None:
        try:
            shape = None if person is None else person_of(output / person)
            found, arrays, told, rate = (
                _fit_markers(recording, settings, pace, shape, progress)
                if recording.frames is None
                else _fit_frames(recording, settings, pace, progress)
            )
        except ValueError as error:
            raise FileError(recording.paths[0], str(error).removeprefix(f"{recording.paths[0]}: ")) from error
        record = {"name": recording.name, "source": recording.source, **_stages(found), **told}
        record |= {"preset": _preset(recording, settings), "shape_from": person or "itself", "identity": identity}
        record = write_files(folder, {f"{recording.name}.npz": {**_arrays(found, rate), **arrays}}, record)
    return record


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


def _preset(recording: Recording, settings: Settings) -> str:
    """Markers have a preset of their own, unless another was asked for."""
    return "markers" if recording.frames is None and settings.config.name == "fast" else settings.config.name


Found = tuple["Fit", dict[str, np.ndarray], dict[str, Any], float]  # further arrays, what is told, frames a second


def _fit_markers(
    recording: Recording, settings: Settings, pace: Pace, person: Person | None, progress: Progress
) -> Found:
    import ipman_rs.torch as ipt

    from ...data import markers
    from ...data.markers import own
    from ...data.markers.judged import of_skin, of_tracks
    from .. import config, marker_fit

    preset, path = _preset(recording, settings), recording.paths[0]
    chosen = config.load(preset) if preset == "markers" else settings.config
    body = ipt.BodyModel(settings.model)
    names = None if settings.markers is None else own.read(settings.markers, body.body)
    tracks = markers.read(path, settings.up, settings.subject, settings.units, settings.rate)
    judged = of_tracks(tracks, names, settings.up is not None, settings.ground or 0.0)
    flags = judge.admit(path, judged, settings.force)
    count = len(range(0, len(tracks), pace.every))
    with progress(f"fitting {recording.name}", count) as step:
        told = {"every": pace.every, "ground": settings.ground or 0.0, "person": person, "own": names}
        found = marker_fit.fit_tracks(
            body, tracks, chosen, **told, progress=lambda _stage, done: step.to(min(done, count))
        )
    findings, distances = marker_fit.check_fit(found), found.skin_distances
    flags = (*flags, *judge.admit(path, [*findings, *of_skin(distances)], settings.force))
    errors = found.errors
    each = {name: _mean(column) for name, column in zip(found.tracks.names, errors.T, strict=True)}
    sites = {name: site if isinstance(site, str) else asdict(site) for name, site in found.sites.items()}
    record = {"mean_marker_error_m": _mean(errors), "marker_errors_m": each, "skin_distances_m": distances}
    record |= {"unknown": [*found.unknown], "unseen": [*found.unseen], "flags": [*flags]}
    notes = [*tracks.notes, *_own_notes(names, tracks.names, settings), *_marker_notes(found, settings)]
    record |= {"notes": notes, "sites": sites}
    if any(finding.level == "wrong" for finding in findings):
        record["converged"] = False
    return found.fit, {"times": found.tracks.times}, record, found.tracks.rate or 1.0


def _own_notes(own: Mapping[str, object] | None, names: Sequence[str], settings: Settings) -> list[str]:
    """Which of the user's names of markers no marker of the recording has."""
    from ...data.markers.names import unmatched

    none = unmatched(names, own or {})
    if not none:
        return []
    more = f" and {len(none) - 8} more" if len(none) > 8 else ""
    return [f"no marker is called {', '.join(none[:8])}{more}, as {settings.markers} has it (--markers)"]


def _marker_notes(found: MarkerFit, settings: Settings) -> list[str]:
    """What was done with the markers that is not odd."""
    notes = []
    if settings.up is not None:
        axis = ", ".join(f"{number:g}" for number in settings.up)
        notes.append(f"up: ({axis}) of the file's axes, turned to y: the bodies are y up")
    if found.unseen:
        notes.append(f"{len(found.unseen)} markers of the file were never seen: {', '.join(found.unseen)}")
    usual = [away for name, away in found.skin_distances.items()]
    if usual:
        middle = 1e3 * float(np.median(usual))
        notes.append(f"markers: {middle:.0f} mm from the skin in the median, 7 to 15 is usual (all in fit.json)")
    return notes


def _mean(errors: np.ndarray) -> float | None:
    """The mean of what is known."""
    known = errors[np.isfinite(errors)]
    return float(known.mean()) if len(known) else None


def _fit_frames(recording: Recording, settings: Settings, pace: Pace, progress: Progress) -> Found:
    import ipman_rs.torch as ipt

    from ...data.keypoints.detections import join
    from .. import start
    from ..sequence import fit_sequence
    from .items import look
    from .run import problem_of

    assert recording.frames is not None
    items, unseen = recording.frames[:: pace.every], []
    with progress(f"reading {recording.name}", len(items)) as step:
        for item in items:
            try:
                if item.seen is None:
                    look(item)
            except FileError as error:
                unseen.append(f"{item.source}: {error.what}")
            step.one()
    kept = [item for item in items if item.seen is not None]
    if not kept:
        raise ValueError(f"nobody was found in any of {len(items)} frames; first of all: {unseen[0]}")
    body = ipt.BodyModel(settings.model)
    seen, imitated = join([item.seen for item in kept if item.seen is not None]), settings.presented(body.body)
    problem = problem_of(body, seen, settings, imitated)
    rate = pace.fps / pace.every
    with progress(f"fitting {recording.name}", len(kept)) as step:
        problem, variables = start.initial_state(problem, settings.config.start)
        told = {"rate": rate, "progress": lambda _stage, done: step.to(min(done, len(kept)))}
        found = fit_sequence(problem, variables, settings.config, **told)
    assert problem.points is not None
    median = (found.candidate.projected - problem.points).norm(dim=-1).median()
    notes = list(dict.fromkeys(note for item in items for note in item.notes))
    flags = list(dict.fromkeys(flag for item in items for flag in item.flags))
    if len(flags) > TOLD:
        flags = [*flags[:TOLD], f"{len(flags) - TOLD} more such flags of frames"]
    record: dict[str, Any] = {"frames_left_out": unseen, "median_error_px": _number(median)}
    record |= {"notes": notes, "flags": flags}
    if imitated is not None:
        record |= {"presented": imitated.record(body.body), "notes": [*notes, *imitated.notes]}
    return found, {}, record, rate


def _stages(found: Fit) -> dict[str, Any]:
    stages = [
        {
            "name": stage.name,
            "reason": stage.reasons[0],
            "iterations": int(stage.iterations[0]),
            "terms": {name: _number(cost.mean()) for name, cost in stage.terms.items()},
        }
        for stage in found.stages
    ]
    return {"converged": bool(found.converged.all()), "stages": stages}


def _arrays(found: Fit, rate: float) -> dict[str, np.ndarray]:
    """Parameters over time, as `ipman analyze` reads them."""
    from ..result import parameters

    body = found.problem.body.body
    arrays = parameters(body, found.variables)
    arrays |= {"betas": arrays["betas"][:1], "mocap_frame_rate": np.array(rate), "model": np.array(body.name)}
    if found.problem.ground is not None:
        arrays["ground_height"] = found.problem.ground.height[:1].numpy()
    return arrays


def _measured(recording: Recording, folder: Path, settings: Settings) -> Study:
    from ...study.from_file import Request, analyze_file

    path = folder / f"{recording.name}.npz"
    height = float(safe_npz.read(path, "ground_height")[0]) if "ground_height" in safe_npz.names(path) else None
    study = analyze_file(path, Request(model=settings.model, ground=height))
    slow = judge.rate(float(safe_npz.read(path, "mocap_frame_rate")))  # some of the recording's frames are left out
    known = {finding.what for finding in slow}
    return replace(study, flags=tuple(flag for flag in study.flags if flag.partition(";")[0] not in known))


def _identity(recording: Recording, settings: Settings, pace: Pace, person: str | None) -> str:
    """A hash of all that a fit depends on; `person`: that of the fit whose shape is kept."""
    digest = hashlib.sha256(json.dumps([settings.identity(), repr(pace), person]).encode())
    for path in recording.paths:
        digest.update(hashlib.sha256(path.read_bytes()).digest())
    return digest.hexdigest()


def _number(value: Any) -> float | None:
    return float(value) if np.isfinite(float(value)) else None


def recordings(tracks: Sequence[Path], items: Sequence[Item]) -> list[Recording]:
    """One of each marker file, and one of all the items, in their order."""
    found = [Recording(path.stem, str(path), [path]) for path in tracks]
    if items:
        folder = items[0].path.resolve().parent
        found.append(Recording(folder.name, str(folder), [item.path for item in items], [*items]))
    return found
