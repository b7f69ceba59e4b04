"""C3D files: points, and the analogue channels of force plates. Needs the extra `c3d`: pip install "ipman_rs[c3d]"."""

from __future__ import annotations

import os
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .tracks import METRES, Tracks, tracks

Array = NDArray[np.float64]

BLOCK = 512  # bytes; a file's parts begin at blocks


@dataclass(frozen=True, eq=False)
class Recording:
    """What a file holds: P points in T samples, in the file's own unit and axes, and A analogue channels beside them.

    A point that was not seen is NaN. `parameters` are ezc3d's, by group and name: see `values`.
    """

    names: tuple[str, ...]  # P, as the file has them, such as "SensorMat:M_1"
    points: Array  # (T, P, 3), in `unit`
    times: Array  # (T,) s
    rate: float  # Hz, of the points; 0 if the file does not say
    unit: str  # of the points; "" if the file does not say
    up: str  # "x", "y" or "z": its Y_SCREEN, z if it has none
    analogs: Array  # (T * n, A), n samples of the channels to one of the points
    parameters: Any
    source: str

    def values(self, group: str, name: str) -> list[Any]:
        """A parameter's values, flat; none if there is no such parameter."""
        try:
            return list(np.ravel(self.parameters[group][name]["value"], order="F"))
        except KeyError:
            return []

    def positions(self, names: Sequence[str]) -> Array:
        """(T, n, 3) m of these points; ValueError if one is missing, or in an unknown unit."""
        missing = [name for name in names if name not in self.names]
        if missing:
            raise ValueError(f"{self.source}: no point {missing[0]!r}; it has {', '.join(self.names) or 'none'}")
        if self.unit.lower() not in METRES:
            raise ValueError(f"{self.source}: units: expected one of {', '.join(METRES)}, got {self.unit!r}")
        return self.points[:, [self.names.index(name) for name in names]] * METRES[self.unit.lower()]


def read(path: str | os.PathLike[str]) -> Recording:
    """The content of a C3D file.

    ImportError without the extra. ValueError, naming the file, if it is missing, damaged or shorter than it says.
    """
    try:
        import ezc3d
    except ImportError as error:
        raise ImportError(f'C3D files need ezc3d: pip install "ipman_rs[c3d]" ({error})') from error
    path = Path(path)
    if not path.is_file():
        raise ValueError(f"{path}: no such file")
    _whole(path)
    try:
        content = ezc3d.c3d(str(path))
    except Exception as error:  # of a dozen types
        raise ValueError(f"{path}: expected a C3D file: {error}") from None
    about = content["parameters"]["POINT"]
    points = np.moveaxis(content["data"]["points"][:3], 0, -1).swapaxes(0, 1)  # (T, P, 3)
    names = [str(name).strip() for name in _values(about, "LABELS")]
    for more in range(2, 2 + points.shape[1] // 255):  # a parameter holds up to 255 labels, LABELS2 the next
        names += [str(name).strip() for name in _values(about, f"LABELS{more}")]
    if len(names) < points.shape[1]:
        raise ValueError(f"{path}: expected {points.shape[1]} names of points, got {len(names)}")
    rate = float((_values(about, "RATE") or [0.0])[0])
    first = content["header"]["points"]["first_frame"]
    return Recording(
        names=tuple(names[: points.shape[1]]),
        points=np.asarray(points, np.float64),
        times=(first + np.arange(len(points))) / (rate if rate > 0 else 1.0),
        rate=rate,
        unit="".join(_values(about, "UNITS")[:1]).strip(),
        up="".join(_values(about, "Y_SCREEN"))[-1:].lower() or "z",
        analogs=np.asarray(content["data"]["analogs"][0].T, np.float64),
        parameters=content["parameters"],
        source=str(path),
    )


def markers(path: str | os.PathLike[str], up: str | None = None) -> Tracks:
    """The markers of a C3D file; which axis is up says its Y_SCREEN, z if it does not.

    ImportError without the extra. ValueError, naming the file, if it is missing, damaged or has no markers.
    """
    found = read(path)
    names = [name.rpartition(":")[2] for name in found.names]  # without the subject
    return tracks(names, found.points, found.times, found.unit, up or found.up, found.source)


def _values(about: Any, name: str) -> list[Any]:
    return list(about[name]["value"]) if name in about else []


def _whole(path: Path) -> None:
    """ValueError for a file that ends before the data that its header announces: ezc3d reads on in zeros."""
    with path.open("rb") as stream:
        header = stream.read(BLOCK)
    size = path.stat().st_size
    if size < BLOCK or header[1] != 0x50:
        raise ValueError(f"{path}: expected a C3D file, got something else")
    if header[0] == 0 or size < (header[0] - 1) * BLOCK + 4:
        raise ValueError(f"{path}: expected a C3D file: it ends before its parameters; is the download complete?")
    with path.open("rb") as stream:
        stream.seek((header[0] - 1) * BLOCK + 3)
        processor = stream.read(1)[0] - 83
    order = ">" if processor == 3 else "<"  # 1 Intel, 2 DEC (its integers are Intel's), 3 MIPS
    points, analogs, first, last = np.frombuffer(header, f"{order}u2", 4, 2)
    scale = np.frombuffer(header, f"{order}u2", 2, 12)
    start = int(np.frombuffer(header, f"{order}u2", 1, 16)[0])
    # Any float is negative if its sign bit is set; DEC's lies in the first of its two words.
    negative = bool(scale[0 if processor == 2 or order == ">" else 1] >> 15)
    frames = int(last) - int(first) + 1
    if last == 0xFFFF or frames < 1:  # more frames than fit into two bytes: parameters say how many
        frames = 1
    needed = (start - 1) * BLOCK + frames * (4 * int(points) + int(analogs)) * (4 if negative else 2)
    if size < needed:
        raise ValueError(f"{path}: expected {needed} bytes by its header, got {size}: is the download complete?")
