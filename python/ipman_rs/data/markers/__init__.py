"""Optical markers: their recorded tracks, and where they are stuck on a body.

tracks = markers.read("squats.trc")
sites = markers.sites(body, tracks.names)                 # of the markers that are known
landmarks = Landmarks(body, sites, sites)                 # with the markers' names
observed = tracks.select(landmarks.names)
"""

from __future__ import annotations

import os
from collections.abc import Callable, Iterable, Mapping, Sequence
from pathlib import Path

from ipman_rs.body import BodyModel
from ipman_rs.data import c3d, trc
from ipman_rs.data.tracks import Tracks, turn_up

from ...body.landmarks import SIDES
from ...body.sites import Inner, Point, Site
from .anatomy import HIP_CENTRE, MIDDLE, RADIUS, SIDED, SPREAD, Anatomy
from .names import meanings
from .sets import MARKERS, Meaning

READERS: dict[str, Callable[..., Tracks]] = {".trc": trc.read, ".c3d": c3d.markers}

__all__ = ["MARKERS", "READERS", "Inner", "Point", "Site", "Tracks", "meanings", "places", "read", "sites"]


def read(
    path: str | os.PathLike[str],
    up: str | Sequence[float] | None = None,
    subject: str | None = None,
    unit: float | None = None,
    rate: float | None = None,
) -> Tracks:
    """The markers of a `.trc` or `.c3d` file in metres, y up; its `notes` say what was left out or mended.

    What the file does not say, or not rightly: `up`, which axis is up, "x", "y" or "z", or a direction (3,) in the
    file's axes; `unit`, metres in one of its lengths; `rate`, Hz. `subject`: whose markers, where the file has those of
    several people ("S01:LASI"). ValueError, naming the file, for whatever is not right.
    """
    suffix = Path(path).suffix.lower()
    if suffix not in READERS:
        raise ValueError(f"{path}: expected a file of markers ({', '.join(READERS)}), got {suffix or 'no ending'}")
    if up is None or isinstance(up, str):
        return READERS[suffix](Path(path), up, subject, unit, rate)
    return turn_up(READERS[suffix](Path(path), "y", subject, unit, rate), up)


def sites(
    body: BodyModel, markers: Iterable[str], radius: float = RADIUS, own: Mapping[str, Meaning | None] | None = None
) -> dict[str, Point]:
    """Where these markers of one file are on the body: a site on the skin, a point inside, or a joint's name.

    Unknown markers are left out (`names.meanings`). `radius`: of the markers, m, from the skin to what was recorded.
    `own`: further names and the places that they mean, as `own.read` has them.
    """
    anatomy = Anatomy(body, radius)
    return {name: _site(anatomy, meaning) for name, meaning in meanings(list(markers), own).items()}


def _site(anatomy: Anatomy, meaning: Meaning) -> Point:
    if isinstance(meaning, tuple):
        side, place, spread = meaning
        return anatomy.site(place, side, spread)
    if meaning in MIDDLE:
        return anatomy.site(MIDDLE[meaning])
    side, _, name = meaning.partition("_")
    if name == HIP_CENTRE:
        return anatomy.hip_centre(side)
    return anatomy.site(SIDED[name], side, SPREAD.get(name, RADIUS)) if name in SIDED else meaning


def places(body: BodyModel) -> tuple[str, ...]:
    """The names of all places that a marker can be said to be at: sites on the skin, hip centres, joints."""
    sided = [f"{side}_{name}" for name in (*SIDED, HIP_CENTRE) for side in SIDES]
    return tuple(dict.fromkeys([*MIDDLE, *sided, *body.joint_names]))
