"""Optical markers: their recorded tracks, and where they are stuck on a body.

tracks = markers.read("squats.trc")
sites = markers.sites(body, tracks.names)                 # of the markers that are known
landmarks = Landmarks(body, sites, sites)                 # with the markers' names
observed = tracks.select(landmarks.names)
"""

from __future__ import annotations

import os
from collections.abc import Callable, Iterable
from pathlib import Path

from ipman_rs.body import BodyModel
from ipman_rs.data import c3d, trc
from ipman_rs.data.tracks import Tracks

from ..landmarks import Site
from .anatomy import MIDDLE, RADIUS, SIDED, Anatomy
from .sets import MARKERS, Meaning

READERS: dict[str, Callable[..., Tracks]] = {".trc": trc.read, ".c3d": c3d.markers}

__all__ = ["MARKERS", "READERS", "Site", "Tracks", "read", "sites"]


def read(path: str | os.PathLike[str], up: str | None = None, subject: str | None = None) -> Tracks:
    """The markers of a `.trc` or `.c3d` file in metres, y up; its `notes` say what was left out or mended.

    `up`: which axis of the file is up, if it does not say so rightly. `subject`: whose markers, where the file has
    those of several people ("S01:LASI"). ValueError, naming the file, for whatever is not right.
    """
    suffix = Path(path).suffix.lower()
    if suffix not in READERS:
        raise ValueError(f"{path}: expected a file of markers ({', '.join(READERS)}), got {suffix or 'no ending'}")
    return READERS[suffix](Path(path), up, subject)


def sites(body: BodyModel, markers: Iterable[str], radius: float = RADIUS) -> dict[str, Site | str]:
    """Where these markers are on the body: a site on the skin, or a joint's name. Unknown markers are left out.

    `radius`: of the markers, m, from the skin to what was recorded.
    """
    anatomy = Anatomy(body, radius)
    return {name: _site(anatomy, MARKERS[name]) for name in markers if name in MARKERS}


def _site(anatomy: Anatomy, meaning: Meaning) -> Site | str:
    if isinstance(meaning, tuple):
        side, place = meaning
        return anatomy.site(place, side)
    if meaning in MIDDLE:
        return anatomy.site(MIDDLE[meaning])
    side, _, name = meaning.partition("_")
    return anatomy.site(SIDED[name], side) if name in SIDED else meaning
