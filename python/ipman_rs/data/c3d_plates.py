"""The force plates of a `.c3d` file: where each lies, and the wrench that its channels measured, by its type."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from . import c3d
from .c3d_format import parameter_values
from .check import size_of_body
from .tracks import unit_note, visibility
from .units import metres, newton_metres, newtons

Array = NDArray[np.float64]

LOADED = 20.0  # N: with less, a plate's centre of pressure is noise
MOST = 64  # plates
HEAVY = 200.0  # N: of such a load the centre of pressure is known well
SHORTEST, LONGEST = 0.05, 4.0  # m: sides of a plate
CHANNELS = {1: 6, 2: 6, 3: 8, 4: 6}  # of a plate, by its type
OTHER_TYPES = {  # what they are, for whoever has one
    5: "eight channels with a matrix",
    6: "twelve channels with a matrix",
    7: "a Kistler plate with a matrix",
    11: "Kistler's treadmill",
    12: "Kistler's treadmill with two belts",
    21: "AMTI's stairs",
}


def usable_plates(file: c3d.C3DFile, used: int) -> tuple[list[Plate], tuple[str, ...]]:
    """The plates that can be computed, and what is wrong with the others. ValueError if it is something with each."""
    plates, wrong = [], []
    scale, notes = _plates_unit(file)
    notes = (*(note for note in file.notes if note == unit_note(file.unit)), *notes)
    for index in range(min(used, MOST)):
        try:
            plate = Plate.of(file, index, scale)
            _ = plate.axes  # of corners that make a plate
            notes = (*notes, *plate.astray())
            plates.append(plate)
        except ValueError as error:
            wrong.append(str(error))
    if not plates:
        raise ValueError(wrong[0])
    return plates, (*notes, *(f"{what.removeprefix(f'{file.source}: ')}; left out" for what in wrong))


def _plates_unit(file: c3d.C3DFile) -> tuple[float, tuple[str, ...]]:
    """Metres in the unit of corners and origins: the points', unless only the points, a person's, can be in it."""
    scale = file.metres
    values = [value for value in file.values("FORCE_PLATFORM", "CORNERS") if isinstance(value, (int, float))]
    corners = np.array(values[: len(values) // 12 * 12], float).reshape(-1, 4, 3)
    sides = np.linalg.norm(corners[:, 0] - corners[:, 1], axis=-1)
    sides = sides[np.isfinite(sides) & (sides > 0)]
    if not len(sides) or np.median(sides) * scale <= LONGEST or not SHORTEST < np.median(sides) * 1e-3 <= LONGEST:
        return scale, ()
    own = file.markers(next(iter(file.subjects), None))
    visible, _ = visibility(file.points[:, own.columns], own.names)
    points = np.where(visible[..., None], file.places(own.columns), np.nan)
    if not visible.any() or size_of_body("points", points)[0].level != "ok":
        return scale, ()  # all are in another unit than the file says
    return 1e-3, (f"the corners of the force plates are in millimetres, its points in {file.unit}",)


@dataclass(frozen=True, eq=False)
class Plate:
    """A plate's own numbers: axes x and y along its edges, z = x × y (down), about its transducer's origin."""

    place: str  # file and number, for errors
    corners: Array  # (4, 3) m, in the world: at +x +y, -x +y, -x -y, +x -y
    forces: Array  # (T, 3) N
    points: Array  # (T, 2) m, centres of pressure from the middle of the surface; not finite without a load
    free: Array  # (T,) N m about z at the centre of pressure
    unit: str  # of its moments, of type 1 of its centres of pressure, as the file says; "" if it does not

    @classmethod
    def of(cls, file: c3d.C3DFile, index: int, scale: float) -> Plate:
        """`scale`: metres in the unit of its corners and origin."""
        place = f"{file.source}: force plate {index + 1}"
        kind = _type(file, index, place)
        corners = _numbers_of_plate(file, "CORNERS", index, 12, place).reshape(4, 3) * scale
        origin = _numbers_of_plate(file, "ORIGIN", index, 3, place) * scale
        channels = _channels(file, index, kind, place)
        units = _units(file, channels)
        signals = _signals(file, index, kind, channels, scale, place)
        if kind == 1:
            return cls(place, corners, signals[:, :3], signals[:, 3:5], signals[:, 5], units[3])
        forces, moments = _kistler(signals, origin) if kind == 3 else (signals[:, :3], signals[:, 3:])
        # The sensors lie under the surface and z points down, but many files have the vector the other way round.
        origin = -origin if origin[2] > 0 else origin
        if kind == 3:
            origin = np.array([0.0, 0.0, origin[2]])
        moments = moments - np.cross(origin, forces)  # about the middle of the surface
        with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
            x, y = -moments[:, 1] / forces[:, 2], moments[:, 0] / forces[:, 2]
            free = moments[:, 2] - x * forces[:, 1] + y * forces[:, 0]
        return cls(place, corners, forces, np.stack([x, y], axis=1), free, "" if kind == 3 else units[3])

    def astray(self) -> list[str]:
        """In words that its centre of pressure is mostly beside its corners; ValueError if it is farther from them
        than the plate is long, as in another unit."""
        heavy = np.abs(self.forces[:, 2]) > HEAVY
        first, second, third, fourth = self.corners
        half = np.linalg.norm([(first + fourth) - (second + third), (first + second) - (third + fourth)], axis=1) / 4
        with np.errstate(invalid="ignore"):
            away = np.linalg.norm(np.maximum(np.abs(self.points[heavy]) - half, 0.0), axis=1)
        away = away[np.isfinite(away)]
        middle = float(np.median(away)) if len(away) else 0.0
        if middle == 0:
            return []
        unit = f", by the file in {self.unit!r}," if self.unit.strip() else ""
        message = f"{self.place}: its centre of pressure is {middle:.3g} m outside its corners"
        if middle > 2 * np.linalg.norm(half):
            raise ValueError(f"{message}: are its moments{unit} in another unit?")
        name = message.removeprefix(self.place.rpartition(": ")[0]).removeprefix(": ")
        return [f"{name} in the median: are its corners and its origin right?"]

    def wrench(self, up: Array) -> tuple[Array, Array, Array]:
        """Force on the body, centre of pressure and moment about it, each (T, 3), in the world."""
        axes = self.axes
        with np.errstate(invalid="ignore", over="ignore"):
            points = self.corners.mean(axis=0) + self.points @ axes[:, :2].T
            force, moment = self.forces @ axes.T, self.free[:, None] * axes[:, 2]
        # Some systems write the force on the plate, others that on the body. Nobody pulls at a plate.
        loads = force @ up
        loads = loads[np.isfinite(loads)]
        sign = -1.0 if loads.size and -loads.min() > max(loads.max(), LOADED) else 1.0
        force, points = (np.where(np.isfinite(part), part, np.nan) for part in (force, points))
        return sign * force, points, sign * np.nan_to_num(moment)

    @cached_property
    def axes(self) -> Array:
        """(3, 3), the plate's axes in the world as columns."""
        first, second, third, fourth = self.corners
        x, y = (first + fourth) - (second + third), (first + second) - (third + fourth)
        z = np.cross(x, y)
        area = np.linalg.norm(z)
        if not area > 1e-3 or np.linalg.norm(x) > 4 or np.linalg.norm(y) > 4:
            sides = f"{np.linalg.norm(x) / 2:.3g} × {np.linalg.norm(y) / 2:.3g} m"
            hint = "; looks like millimetres" if area > 100 else ""
            raise ValueError(f"{self.place}: CORNERS: expected a plate of a decimetre to two metres, got {sides}{hint}")
        x, z = x / np.linalg.norm(x), z / area
        return np.stack([x, np.cross(z, x), z], axis=1).astype(np.float64)


def _type(file: c3d.C3DFile, index: int, place: str) -> int:
    """Which of the types that can be computed."""
    kind = next(iter(whole_numbers(file, "TYPE")[index : index + 1]), None)
    if kind in CHANNELS:
        return kind
    expected = f"TYPE: expected one of {', '.join(map(str, CHANNELS))}"
    if kind is None:
        raise ValueError(f"{place}: {expected}, got none")
    what = f" ({OTHER_TYPES[kind]})" if kind in OTHER_TYPES else ""
    raise ValueError(
        f"{place}: {expected}, got type {kind}{what}; export its forces and moments as type 2, or as a .mot file"
    )


def whole_numbers(file: c3d.C3DFile, name: str) -> list[int]:
    """The numbers of a parameter of counts; 0 for what is none."""
    values = file.values("FORCE_PLATFORM", name)
    return [int(value) if isinstance(value, (int, float)) and np.isfinite(value) else 0 for value in values]


def _numbers_of_plate(file: c3d.C3DFile, name: str, index: int, size: int, place: str) -> Array:
    """The numbers of one plate of a parameter whose last dimension is the plates. ValueError if some are missing."""
    values = file.values("FORCE_PLATFORM", name)[index * size : (index + 1) * size]
    numbers = np.array([value for value in values if isinstance(value, (int, float))], float)
    if numbers.size != size or not np.isfinite(numbers).all():
        raise ValueError(f"{place}: {name}: expected {size} numbers, got {int(np.isfinite(numbers).sum())}")
    return numbers


def _channels(file: c3d.C3DFile, index: int, kind: int, place: str) -> list[int]:
    """The columns of its signals. ValueError if they are too few, or not there."""
    count = CHANNELS[kind]
    stored = whole_numbers(file, "CHANNEL")
    per_plate = len(stored) // max(len(whole_numbers(file, "TYPE")), 1)
    channels = [number - 1 for number in stored[index * per_plate : (index + 1) * per_plate][:count]]
    if len(channels) < count or min(channels) < 0 or max(channels) >= file.analogs.shape[1]:
        raise ValueError(
            f"{place}: CHANNEL: expected {count} of the {file.analogs.shape[1]} channels, got "
            f"{', '.join(str(channel + 1) for channel in channels) or 'none'}"
        )
    return channels


def _units(file: c3d.C3DFile, channels: Sequence[int]) -> list[str]:
    """As the file says; "" where it does not."""
    units = [str(unit) for unit in parameter_values(file.parameters.get("ANALOG", {}), "UNITS")]
    return ["" if channel >= len(units) else units[channel] for channel in channels]


def _signals(file: c3d.C3DFile, index: int, kind: int, channels: Sequence[int], length: float, place: str) -> Array:
    """(T, 6 or 8) forces in N and moments in N m, or forces alone, in the plate's axes."""
    signals, units = file.analogs[:, channels], _units(file, channels)
    matrix = file.values("FORCE_PLATFORM", "CAL_MATRIX")
    if kind == 4 and matrix:  # raw channels, turned into forces and moments by a matrix; Cortex leaves it empty
        matrix = _numbers_of_plate(file, "CAL_MATRIX", index, 36, place)
        with np.errstate(invalid="ignore", over="ignore"):
            signals, units = signals @ matrix.reshape(6, 6), [""] * 6
    return signals * [_scale(unit, kind, column, length, place) for column, unit in enumerate(units)]


def _scale(unit: str, kind: int, column: int, length: float, place: str) -> float:
    """What makes N, m or N m of a channel; lengths and moments without a unit go with the plate's `length`."""
    if column < 3 or kind == 3:
        expected, scale = "N", 1.0 if not unit.strip() else newtons(unit)
    elif kind == 1 and column < 5:
        # Px and Py are lengths, whatever unit of force the program gave all six channels.
        expected, scale = "mm or m", metres(unit) or (length if not unit.strip() or newtons(unit) else None)
    elif kind == 1 and newtons(unit):
        expected, scale = "N mm or N m", length
    else:
        expected, scale = "N mm or N m", length if not unit.strip() else newton_metres(unit)
    if scale is None:
        raise ValueError(f"{place}: ANALOG:UNITS: expected {expected}, got {unit!r}: is the plate calibrated?")
    return scale


def _kistler(signals: Array, origin: Array) -> tuple[Array, Array]:
    """Forces and moments of eight channels: fx12, fx34, fy14, fy23, and fz of the sensors 1 to 4 at (±a, ±b)."""
    x12, x34, y14, y23, z1, z2, z3, z4 = signals.T
    a, b = np.abs(origin[:2])
    forces = np.stack([x12 + x34, y14 + y23, z1 + z2 + z3 + z4], axis=1)
    moments = np.stack([b * (z1 + z2 - z3 - z4), a * (-z1 + z2 + z3 - z4), b * (x34 - x12) + a * (y14 - y23)], axis=1)
    return forces, moments
