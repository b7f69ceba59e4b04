"""Miniature C3D files: two walking markers and force plates of types 2, 3 and 4 under a known load.

Written with ezc3d's writer; what the plates' channels say is worked out from the physics of a plate, forwards: a force
on a point of the surface, seen by sensors below it.
"""

from __future__ import annotations

import ezc3d
import numpy as np

SAMPLES = 4  # of the channels to one of the points
DEPTH = 0.04  # m, of the sensors under the surface
SENSORS = (0.2, 0.15)  # m, of a Kistler plate's sensors from its middle


def plate(middle, size=(0.6, 0.4), turn=0.0):
    """Corners (4, 3) m of a level plate in the order of the format: at +x+y, -x+y, -x-y, +x-y.

    Its x axis points along `turn` (radians, about the vertical), its z axis down.
    """
    x = np.array([np.cos(turn), np.sin(turn), 0.0])
    y = np.array([np.sin(turn), -np.cos(turn), 0.0])  # x × y = -z: down
    half = np.array(size) / 2
    signs = ((1, 1), (-1, 1), (-1, -1), (1, -1))
    return np.array([np.asarray(middle, float) + i * half[0] * x + j * half[1] * y for i, j in signs])


def six(corners, force, point, free, reaction=True):
    """Fx..Mz (T, 6) in N and N m of a plate's sensors, DEPTH under its surface.

    Force (T, 3) on the body and point (T, 3) in the world, free moment (T,) about the vertical on the body. `reaction`
    False: the plate writes down what the body does to it.
    """
    middle, x, y = corners.mean(axis=0), corners[0] - corners[1], corners[1] - corners[2]
    axes = np.stack([x / np.linalg.norm(x), y / np.linalg.norm(y), [0.0, 0.0, -1.0]])  # rows: world -> plate
    sensor = middle - [0, 0, DEPTH]
    moment = np.cross(point - sensor, force) + free[:, None] * [0, 0, 1.0]
    sign = 1.0 if reaction else -1.0
    return sign * np.concatenate([force @ axes.T, moment @ axes.T], axis=1)


def eight(corners, force, point):
    """The sensors of a Kistler plate: shear shared by the two of a pair, weight by where it stands.

    Forces without free moment; the sensors' planes are DEPTH under the surface.
    """
    values = six(corners, force, point, np.zeros(len(force)))
    fx, fy, fz, mx, my, mz = values.T
    a, b = SENSORS
    # fz1..fz4 at (a, b), (-a, b), (-a, -b), (a, -b): the least uneven shares that give fz, mx and my.
    z = [fz / 4 + i * -my / (4 * a) + j * mx / (4 * b) for i, j in ((1, 1), (-1, 1), (-1, -1), (1, -1))]
    # fx12 at y = b, fx34 at y = -b, fy14 at x = a, fy23 at x = -a: the moment goes to the x pair.
    shear = [fx / 2 - mz / (2 * b), fx / 2 + mz / (2 * b), fy / 2, fy / 2]
    return np.stack([*shear, *z], axis=1)


def write(path, markers, rate=100.0, unit="mm", up="+Z", plates=(), labels=None, moment_unit="Nmm", force_unit="N"):
    """Markers {name: (T, 3) m} and plates [(type, corners (4, 3) m, channels (T * SAMPLES, n) in N and N m), ...]."""
    scale = {"mm": 1000.0, "m": 1.0, "cm": 100.0}[unit]
    file = ezc3d.c3d()
    count = len(next(iter(markers.values())))
    file["parameters"]["POINT"]["RATE"]["value"] = [rate]
    file["parameters"]["POINT"]["UNITS"]["value"] = [unit]
    file["parameters"]["POINT"]["LABELS"]["value"] = list(labels or markers)
    points = np.ones((4, len(markers), count))
    points[:3] = np.stack(list(markers.values())).transpose(2, 0, 1) * scale
    file["data"]["points"] = points
    file.add_parameter("POINT", "X_SCREEN", ["+X"])
    if up:
        file.add_parameter("POINT", "Y_SCREEN", [up])
    if plates:
        _plates(file, plates, scale, rate, unit, moment_unit, force_unit)
    file.write(str(path))


def _plates(file, plates, scale, rate, unit, moment_unit, force_unit):
    factor = {"Nmm": 1000.0, "Nm": 1.0, "": scale}[moment_unit]
    channels, numbers, units = [], [], []
    for kind, _corners, values in plates:
        width = values.shape[1]
        numbers.append([len(channels) + 1 + index for index in range(width)])
        moments = [kind != 3 and index >= 3 for index in range(width)]
        channels += [values[:, index] * (factor if moments[index] else 1.0) for index in range(width)]
        units += [moment_unit if moment else force_unit for moment in moments]
    most = max(map(len, numbers))
    file["parameters"]["ANALOG"]["RATE"]["value"] = [rate * SAMPLES]
    file["parameters"]["ANALOG"]["LABELS"]["value"] = [f"channel{index}" for index in range(len(channels))]
    file["data"]["analogs"] = np.stack(channels)[None]
    file.add_parameter("ANALOG", "UNITS", units)
    file.add_parameter("FORCE_PLATFORM", "USED", [len(plates)])
    file.add_parameter("FORCE_PLATFORM", "TYPE", [kind for kind, *_ in plates])
    file.add_parameter("FORCE_PLATFORM", "ZERO", [1, 0])
    corners = np.stack([corners for _, corners, _ in plates]) * scale
    file.add_parameter("FORCE_PLATFORM", "CORNERS", corners.transpose(2, 1, 0))
    origins = [[*(SENSORS if kind == 3 else (0.0, 0.0)), -DEPTH] for kind, *_ in plates]
    file.add_parameter("FORCE_PLATFORM", "ORIGIN", np.array(origins).T * scale)
    padded = np.array([[*row, *[0] * (most - len(row))] for row in numbers])
    file.add_parameter("FORCE_PLATFORM", "CHANNEL", padded.T.astype(float))
    if any(kind == 4 for kind, *_ in plates):
        file.add_parameter("FORCE_PLATFORM", "CAL_MATRIX", np.stack([MATRIX] * len(plates), axis=2))


# Forces and moments = MATRIX @ channels, of a plate of type 4 whose channels are volts and talk to each other.
MATRIX = np.diag([150.0, 150.0, 600.0, 90.0, 90.0, 60.0]) + np.tri(6, k=-1) * 0.7
