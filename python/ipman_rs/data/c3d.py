"""C3D files: points, the outputs of models among them, and the analogue channels of force plates."""

from __future__ import annotations

import os
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from ipman_rs.files import read_bytes

from . import c3d_format
from .c3d_format import Parameters, parameter_values
from .tracks import (
    METRES,
    TO_Y_UP,
    MarkerColumns,
    Tracks,
    alphanumeric,
    likely_unit,
    list_names,
    select_markers,
    tracks,
    unit_note,
    visibility,
)
from .units import metres

Array = NDArray[np.float64]

MAX_BYTES = 1 << 32  # an hour of ten plates and of two hundred markers is smaller
AGAIN = "write it again with Mokka or the program that recorded it"
GROUPS = ("ANGLES", "FORCES", "MOMENTS", "POWERS", "SCALARS", "REACTIONS", "MODELED_MARKERS", "SYMBOLIC")  # of POINT
OUTPUTS = re.compile(r".*(?:Angles?|Moment|Force|Power|GRF|Progress\w*)(?:Harrington)?|Cent(?:re|er)OfMass\w*")
CENTER_OF_MASS = ("centreofmass", "centerofmass", "com", "wholebodycom")  # free of case and punctuation


@dataclass(frozen=True, eq=False)
class C3DFile:
    """The content of a C3D file: P points in T samples, in the file's unit and axes, and A analogue channels.

    A point that was not seen is NaN. `outputs` are the points that a model computed, `markers` the others.
    """

    names: tuple[str, ...]  # P, as the file has them, such as "SensorMat:M_1"
    points: Array  # (T, P, 3), in `unit`
    times: Array  # (T,) s
    rate: float  # Hz, of the points; 0 if the file does not say
    unit: str | float  # of the points, its name or metres in one; the likely one, with a note, if the file does not say
    up: str  # "x", "y" or "z": its Y_SCREEN; without one the axis that its force plates face, or z
    analogs: Array  # (T * n, A), n samples of the channels to one of the points
    parameters: Parameters  # by group and name
    source: str
    notes: tuple[str, ...] = ()  # what was mended in reading

    def values(self, group: str, name: str) -> list:
        """A parameter's values, flat; none if there is no such parameter."""
        return list(self.parameters.get(group, {}).get(name, []))

    @property
    def has_plates(self) -> bool:
        """Whether it has force plates, and what they measured."""
        return _number(self.parameters.get("FORCE_PLATFORM", {}), "USED") > 0 and len(self.analogs) > 0

    @property
    def subjects(self) -> list[str]:
        """The people, or things, whose names stand before a colon in the points' ("S01:LASI")."""
        people = (name.rpartition(":")[0].strip() for name in self.names)
        return [*dict.fromkeys(person for person in people if person)]

    @cached_property
    def outputs(self) -> Mapping[str, Array]:
        """What a model computed (T, 3) by name, in its own unit: angles, moments, powers, axes, centre of mass."""
        return {self.names[column]: self.points[:, column] for column in self._computed}

    @cached_property
    def _computed(self) -> list[int]:
        listed = {name for group in GROUPS for name in parameter_values(self.parameters.get("POINT", {}), group)}
        bare = [name.rpartition(":")[2] for name in self.names]
        axes = {name[:3] for name in bare if all(name[:3] + end in bare for end in "OALP")}  # LFEO, LFEA, LFEL, LFEP
        return [
            column
            for column, (name, own) in enumerate(zip(self.names, bare, strict=True))
            if name in listed
            or own in listed
            or OUTPUTS.fullmatch(own)
            or (len(own) == 4 and own[:3] in axes and own[3] in "OALP")
            or alphanumeric(own) in CENTER_OF_MASS
        ]

    @cached_property
    def _measured(self) -> list[int]:
        """The columns of points that no model computed."""
        computed = set(self._computed)
        return [column for column in range(len(self.names)) if column not in computed]

    def markers(self, subject: str | None = None) -> MarkerColumns:
        """The points that are markers of the person, without the subject before a colon; see `tracks.select_markers`.

        ValueError for two people of whom none is chosen.
        """
        rest = self._measured
        visible, _ = visibility(self.points[:, rest], [self.names[column] for column in rest])
        chosen = select_markers([self.names[column] for column in rest], visible, self.source, subject)
        return MarkerColumns(chosen.names, [rest[column] for column in chosen.columns], chosen.notes)

    def center_of_mass(self, subject: str | None = None) -> Array | None:
        """The whole body's centre of mass (T, 3) m in the file's axes, as a model such as Plug-in Gait computed it.

        NaN where it has none; None if it is not in the file. `subject`: where there are several people.
        """
        for column in self._computed:
            person, _, name = self.names[column].rpartition(":")
            if alphanumeric(name) in CENTER_OF_MASS and subject in (None, person):
                points = self.points[:, column] * self.metres
                return np.where((points == 0).all(axis=-1, keepdims=True), np.nan, points)
        return None

    def positions(self, names: Sequence[str]) -> Array:
        """(T, n, 3) m of these points; ValueError if one is missing, or in an unknown unit."""
        column = {name: index for index, name in reversed([*enumerate(self.names)])}  # of a name twice the first
        missing = [name for name in names if name not in column]
        if missing:
            raise ValueError(f"{self.source}: no point {missing[0]!r}; it has {', '.join(self.names) or 'none'}")
        return self.places([column[name] for name in names])

    def places(self, columns: Sequence[int]) -> Array:
        """(T, n, 3) m of the points in these columns. ValueError for an unknown unit."""
        return self.points[:, columns] * self.metres

    @property
    def metres(self) -> float:
        """In one of the points' lengths. ValueError for an unknown unit."""
        scale = metres(self.unit) if isinstance(self.unit, str) else self.unit
        if scale is None:
            raise ValueError(f"{self.source}: units: expected one of {', '.join(METRES)}, got {self.unit!r}")
        return scale


def read(path: str | os.PathLike[str]) -> C3DFile:
    """The content of a C3D file. ValueError, naming the file, if it is missing, damaged or shorter than it says."""
    data = read_bytes(path, MAX_BYTES)
    try:
        content = c3d_format.content(data)
    except ValueError as error:
        message = str(error)
        raise ValueError(f"{path}: {message}" if message.endswith("?") else f"{path}: {message}; {AGAIN}") from None
    about, count = content.parameters["POINT"], content.points.shape[1]
    names = [str(name) for name in parameter_values(about, "LABELS")][:count]
    names += [""] * (count - len(names))
    rate = _number(about, "RATE")
    screen = "".join(str(value) for value in about.get("Y_SCREEN", []))
    axis = screen.strip()[-1:].lower()
    file = C3DFile(
        names=tuple(names),
        points=content.points,
        times=(content.first + np.arange(len(content.points))) / (rate if rate > 0 else 1.0),
        rate=rate,
        unit="".join(str(value) for value in about.get("UNITS", [])[:1]),
        up=axis if axis in TO_Y_UP else _faced(content.parameters),
        analogs=content.analogs,
        parameters=content.parameters,
        source=str(path),
        notes=content.notes,
    )
    if screen.strip() and axis not in TO_Y_UP:
        note = f"its Y_SCREEN is {screen!r}, which is no axis: taken as {file.up} up (`up`)"
        file = replace(file, notes=(*file.notes, note))
    if str(file.unit).strip():
        return file
    unit = _likely_unit(file)
    return replace(file, unit=unit, notes=(*file.notes, unit_note(unit)))


def _likely_unit(file: C3DFile) -> str:
    """The unit of a file that does not say it: the one in which its markers, or else its plates, are not too large."""
    rest = file._measured
    visible, _ = visibility(file.points[:, rest], [file.names[column] for column in rest])
    corners = [each for each in file.values("FORCE_PLATFORM", "CORNERS") if isinstance(each, (int, float))]
    places = (
        file.points[:, rest][visible] if visible.any() else np.array(corners[: len(corners) // 3 * 3]).reshape(-1, 3)
    )
    return likely_unit(places) if len(places) else "mm"


def markers(
    path: str | os.PathLike[str],
    up: str | None = None,
    subject: str | None = None,
    unit: float | None = None,
    rate: float | None = None,
) -> Tracks:
    """The markers of a C3D file; which axis is up says its Y_SCREEN, z if it does not.

    `subject`: of whom, where the file has several people. ValueError, naming the file, if it is missing, damaged, has
    no markers, or has those of several people of whom none is chosen.
    """
    file = read(path)
    if not file.names and "ROTATION" in file.parameters:
        raise ValueError(f"{path}: expected markers, it has rotations of segments only, as Theia writes them")
    rest = file._measured
    notes = [note for note in file.notes if unit is None or note != unit_note(file.unit)]
    if file._computed:
        notes.append(f"{len(file._computed)} outputs of a model are no markers: {list_names(list(file.outputs), 4)}")
    names = [file.names[column] for column in rest]
    file_unit, up = file.unit if unit is None else unit, up or file.up
    times = file.times if rate is None else np.arange(len(file.points)) / rate
    return tracks(names, file.points[:, rest], times, file_unit, up, file.source, subject=subject, notes=notes)


def _faced(parameters: Parameters) -> str:
    """The axis that the first force plate faces, by its corners; z if it has none."""
    corners = np.array(parameters.get("FORCE_PLATFORM", {}).get("CORNERS", [])[:12])
    if corners.size != 12 or corners.dtype.kind not in "if" or not np.isfinite(corners).all():
        return "z"
    first, second, third, fourth = corners.reshape(4, 3).astype(np.float64)
    normal = np.abs(np.cross(third - first, fourth - second))
    return "xyz"[int(normal.argmax())] if normal.max() > 0 else "z"


def _number(about: Mapping[str, list], name: str) -> float:
    """A parameter's first number; 0 for none and for one that is no number."""
    value = about.get(name, [])[:1]
    return float(value[0]) if value and isinstance(value[0], (int, float)) and np.isfinite(value[0]) else 0.0
