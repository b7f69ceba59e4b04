"""C3D files. Needs the extra `c3d`: pip install "ipman_rs[c3d]"."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from .tracks import Tracks, tracks


def read(path: str | Path, up: str | None = None) -> Tracks:
    """The markers of a C3D file; which axis is up says its Y_SCREEN, z if it does not.

    ImportError without the extra. ValueError, naming the file, if it is missing, damaged or has no markers.
    """
    source = str(path)
    try:
        import ezc3d
    except ImportError as error:
        raise ImportError(f'C3D files need ezc3d: pip install "ipman_rs[c3d]" ({error})') from error
    if not Path(path).is_file():
        raise ValueError(f"{source}: no such file")
    try:
        content = ezc3d.c3d(source)
    except Exception as error:  # of a dozen types
        raise ValueError(f"{source}: expected a C3D file: {error}") from None
    about = content["parameters"]["POINT"]
    points = np.moveaxis(content["data"]["points"][:3], 0, -1).swapaxes(0, 1)  # (T, M, 3)
    names = [name.rpartition(":")[2] for name in _values(about, "LABELS")][: points.shape[1]]  # without the subject
    screen = "".join(_values(about, "Y_SCREEN"))[-1:].lower()
    rate = (_values(about, "RATE") or [0.0])[0]
    first = content["header"]["points"]["first_frame"]
    times = (first + np.arange(len(points))) / rate if rate > 0 else np.arange(len(points), dtype=float)
    if len(names) < points.shape[1]:
        raise ValueError(f"{source}: expected {points.shape[1]} names of markers, got {len(names)}")
    return tracks(names, points, times, "".join(_values(about, "UNITS")[:1]).strip(), up or screen or "z", source)


def _values(about: Any, name: str) -> list[Any]:
    return list(about[name]["value"]) if name in about else []
