"""Fitting a body to recorded markers: start, the places of this person's markers, and all frames together.

recorded = fit_tracks(ipt.BodyModel("anny"), markers.read("squats.trc"), every=5)
recorded.fit.candidate.vertices            # (T, V, 3) m, in the laboratory
np.nanmean(recorded.errors)                # m, from the markers
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor

import ipman_rs.torch as ipt
from ipman_rs.data import plausibility
from ipman_rs.data.check import Finding
from ipman_rs.renamed import old_names

from ..body.sites import FEWEST_POINTS
from ..data import markers
from ..data.markers.plausibility import on_skin, seen_names
from ..data.markers.sets import Meaning
from ..data.markers.skin_distance import mean_distances
from .camera import Camera
from .config import FitConfig, load
from .fit import Fit
from .landmarks import Landmarks
from .marker_calibration import calibrate_sites, certainty
from .problem import Problem
from .sequence import fit_sequence
from .start import start_at_points

WEIGHED = 8  # bodies whose mass is checked, about
POSES = 24  # frames, evenly spaced over the recording, from which the markers' places are calibrated


@dataclass(frozen=True, eq=False)
class Person:
    """What recordings of one person share: the shape (1, b), and the places of the markers."""

    betas: Tensor
    sites: Mapping[str, markers.Point]


@dataclass(frozen=True, eq=False)
class MarkerFit:
    """The fit of T frames. `tracks` are the M markers with known places, the `sites` on the body; `unknown` are the
    names of markers without a known place, `unseen` those of markers in the file that were never observed.
    `meanings`: of the tracks' names."""

    fit: Fit
    tracks: markers.Tracks
    sites: Mapping[str, markers.Point]
    unknown: tuple[str, ...]
    unseen: tuple[str, ...]
    meanings: Mapping[str, Meaning]

    @property
    def person(self) -> Person:
        """Whose recording it is."""
        return Person(self.fit.variables["betas"][:1], self.sites)

    @property
    def errors(self) -> NDArray[np.float64]:
        """Distances (T, M), m, from the markers to their places on the fitted bodies; NaN where one was not seen."""
        with torch.no_grad():
            away = np.linalg.norm(self.fit.candidate.landmarks.numpy() - self.tracks.points, axis=-1)
        return np.where(self.tracks.confidence > 0, away, np.nan)

    @property
    def skin_distances(self) -> dict[str, float]:
        """The mean distance of each marker from the skin of the fitted bodies, m, outwards; without those whose places
        are inside the body, and without plates and wands, which stand off it."""
        names = [name for name in self.tracks.names if on_skin(self.meanings[name])]
        some = self.tracks.select(names)
        with torch.no_grad():
            vertices = self.fit.candidate.vertices.numpy()
        faces = self.fit.problem.body.body.faces
        away = mean_distances(vertices, faces, some.points, some.confidence)
        return {name: float(mean) for name, mean in zip(names, away, strict=True) if np.isfinite(mean)}


def fit_tracks(
    body: ipt.BodyModel,
    tracks: markers.Tracks,
    config: FitConfig | None = None,
    *,
    every: int = 1,
    calibrate: int = 2,
    smoothness: float = 0.01,
    ground: float = 0.0,
    person: Person | None = None,
    own: Mapping[str, Meaning | None] | None = None,
    progress: Callable[[str, int], None] | None = None,
) -> MarkerFit:
    """Fit every `every`-th frame, by the preset `markers` unless another is given, on the laboratory's floor at y =
    `ground` m.

    `calibrate`: how often the markers are moved on the body to where fits of some frames see them. `person`: of another
    recording of the same day, usually of standing still; shape and places of markers are kept. `own`: names of markers
    and what they mean, beside the known ones (`markers.own`). Markers that were never seen are left out.
    `smoothness` as in `fit_sequence`. ValueError if too few of the markers are known.
    """
    if every < 1:
        raise ValueError(f"every: expected 1 or more, got {every}")
    config = load("markers") if config is None else config
    seen, unseen = seen_names(tracks)
    sites = markers.sites(body.body, seen, own=own)
    if len(sites) < FEWEST_POINTS:
        raise ValueError(
            f"{tracks.source}: expected at least {FEWEST_POINTS} markers with known places, got {len(sites)} of "
            f"{', '.join(seen)}"
        )
    unknown = tuple(name for name in seen if name not in sites)
    tracks = tracks.select(list(sites))
    if person is not None:
        betas = person.betas
        sites |= {name: site for name, site in person.sites.items() if name in sites}
        config = _shape_kept(config)
    else:
        some = select_frames(
            tracks, np.unique(np.linspace(0, len(tracks) - 1, min(POSES, len(tracks))).round().astype(int))
        )
        betas, sites = _calibrated(body, some, sites, ground, config, calibrate, progress)
    tracks = select_frames(tracks, np.arange(0, len(tracks), every))
    problem = problem_of(body, tracks, sites, ground)
    start = start_at_points(problem)
    if betas is not None:
        start["betas"] = betas.expand(len(tracks), -1).clone()
    rate = tracks.rate or 1.0
    fitted = fit_sequence(problem, start, config, smoothness=smoothness, rate=rate, progress=progress)
    return MarkerFit(fitted, tracks, sites, unknown, unseen, markers.meanings(tracks.names, own))


def check_fit(recorded: MarkerFit) -> list[Finding]:
    """Findings about the fit: the markers' mean distance from their places, and the person's mass."""
    with torch.no_grad():
        vertices = recorded.fit.candidate.vertices[:: max(1, len(recorded.tracks) // WEIGHED)]
        mass = np.asarray(ipt.mass_properties(vertices, recorded.fit.problem.body.template).mass)
    errors = recorded.errors
    known = errors[np.isfinite(errors)]
    findings = plausibility.marker_error(float(known.mean())) if len(known) else []
    return findings + plausibility.masses(np.atleast_1d(mass), vertices.numpy())


def _shape_kept(config: FitConfig) -> FitConfig:
    stages = [replace(stage, free=tuple(name for name in stage.free if name != "betas")) for stage in config.stages]
    return replace(config, stages=tuple(stages))


def _calibrated(
    body: ipt.BodyModel,
    tracks: markers.Tracks,
    sites: dict[str, markers.Point],
    ground: float,
    config: FitConfig,
    times: int,
    progress: Callable[[str, int], None] | None,
) -> tuple[Tensor | None, dict[str, markers.Point]]:
    """The shape (1, b) and the places of the markers after that many fits of these frames; none of a shape after 0."""
    variables: dict[str, Tensor] | None = None
    for _ in range(times):
        problem = problem_of(body, tracks, sites, ground)
        start = start_at_points(problem) if variables is None else variables
        fitted = fit_sequence(problem, start, config, smoothness=0, progress=progress)
        variables = dict(fitted.variables)
        bodies = fitted.candidate.full_pose, variables["betas"], variables["transl"]
        points, confidence = torch.from_numpy(tracks.points), torch.from_numpy(tracks.confidence)
        sites = calibrate_sites(body, sites, bodies, points, confidence)
    return None if variables is None else variables["betas"][:1], sites


def problem_of(
    body: ipt.BodyModel, tracks: markers.Tracks, sites: dict[str, markers.Point], ground: float = 0.0
) -> Problem:
    """The frames of `tracks`, whose markers are at `sites`, on a floor at y = `ground`; the camera is a placeholder.

    A marker weighs the less the less its place is known.
    """
    count = len(tracks)

    def each(*numbers: float) -> Tensor:
        return torch.tensor(numbers, dtype=torch.float64).expand(count, -1).clone()

    certain = np.array([certainty(site) for site in sites.values()])
    camera = Camera(each(1, 1), each(0, 0), torch.eye(3, dtype=torch.float64).repeat(count, 1, 1), each(0, 0, 0))
    return Problem(
        body,
        Landmarks(body, sites, sites),
        camera,
        ipt.Ground(each(0, 1, 0), each(ground)[:, 0]),
        points_3d=torch.from_numpy(tracks.points),
        confidence_3d=torch.from_numpy(tracks.confidence * certain),
    )


def select_frames(tracks: markers.Tracks, index: NDArray[np.integer]) -> markers.Tracks:
    """These frames of a recording."""
    return replace(tracks, points=tracks.points[index], confidence=tracks.confidence[index], times=tracks.times[index])


__getattr__ = old_names(__name__, {"Recorded": "MarkerFit", "judged_fit": "check_fit"})
