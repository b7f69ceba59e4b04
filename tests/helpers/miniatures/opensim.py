"""Miniature OpenSim recordings of somebody who sways: markers (.trc), ground forces (.mot), a centre of mass (.sto)."""

from __future__ import annotations

import numpy as np

HEAD = ("Top.Head", "L.ASIS", "R.ASIS", "L.Heel", "R.Heel")
PLACES = np.array([[0, 1.7, 0], [0.1, 1.0, -0.12], [0.1, 1.0, 0.12], [-0.05, 0.03, -0.1], [-0.05, 0.03, 0.1]])


def sway(times):
    """(T, 3) m along x and z."""
    return np.stack([0.02 * np.sin(times), np.zeros_like(times), 0.01 * np.cos(2 * times)], axis=1)


def trc(path, frames=30, rate=60.0, unit="mm", turn=None, cut=None, names=HEAD, missing=(), offset=(0, 0, 0)):
    """The markers, in `unit`; `turn` (3, 3) turns the axes; `missing` (frame, marker) are empty. Gives (T, M, 3) m.

    `cut` lines are written only.
    """
    times = np.arange(frames) / rate
    points = PLACES[None, : len(names)] + sway(times)[:, None] + offset
    written = (points if turn is None else points @ np.asarray(turn).T) * {"mm": 1000.0, "m": 1.0}[unit]
    head = "DataRate\tCameraRate\tNumFrames\tNumMarkers\tUnits\tOrigDataRate\tOrigDataStartFrame\tOrigNumFrames"
    axes = [f"{axis}{number + 1}" for number in range(len(names)) for axis in "XYZ"]
    lines = [
        f"PathFileType\t4\t(X/Y/Z)\t{path.name}",
        head,
        f"{rate:.2f}\t{rate:.2f}\t{frames}\t{len(names)}\t{unit}\t{rate:.2f}\t1\t{frames}",
        "Frame#\tTime\t" + "\t\t\t".join(names) + "\t\t",
        "\t\t" + "\t".join(axes),
        "",
    ]
    for frame, (time, row) in enumerate(zip(times, written, strict=True)):
        cells = [
            "\t\t" if (frame, marker) in missing else "\t".join(f"{x:.6f}" for x in point)
            for marker, point in enumerate(row)
        ]
        lines.append(f"{frame + 1}\t{time:.6f}\t" + "\t".join(cells))
    path.write_text("\n".join(lines[:cut] if cut else [*lines, ""]))
    return points


def storage(path, labels, rows, header=None, degrees="no"):
    """A table in OpenSim's form, or with a header of one's own."""
    head = header or [path.name, "version=1", f"nRows={len(rows)}", f"nColumns={len(labels)}", f"inDegrees={degrees}"]
    body = ["\t".join(f"{value:.8f}" for value in row) for row in rows]
    path.write_text("\n".join([*head, "endheader", "\t".join(labels), *body, ""]))


def forces(path, frames=500, rate=1000.0, scale=1.0, turn=None, weight=700.0):
    """Two plates, one under each foot: gives loads (T, 2) N and points (T, 2, 3) m."""
    times = np.arange(frames) / rate
    left = weight * (0.5 + 0.4 * np.sin(5 * times))
    loads = np.stack([left, weight - left], axis=1)
    feet = np.array([[0.03, 0.0, -0.1], [0.03, 0.0, 0.1]])
    points = feet + sway(times)[:, None] * 0.3
    push = np.stack([0.02 * loads, loads, -0.01 * loads], axis=2)
    vectors = [push, points * scale, np.zeros_like(push)]
    if turn is not None:
        vectors = [each @ np.asarray(turn).T for each in vectors]
    labels, columns = ["time"], [times]
    for foot, begin in enumerate(("ground_force_", "1_ground_force_")):
        for kind, vector in zip("vp", vectors, strict=False):
            labels += [f"{begin}{kind}{axis}" for axis in "xyz"]
            columns += list(vector[:, foot].T)
    for foot, begin in enumerate(("ground_torque_", "1_ground_torque_")):
        labels += [f"{begin}{axis}" for axis in "xyz"]
        columns += list(vectors[2][:, foot].T)
    storage(path, labels, np.stack(columns, axis=1), degrees="yes")
    return loads, points


def center_of_mass(path, frames=20, rate=60.0, begin=0.1, scale=1.0):
    """As BodyKinematics writes it, over a part of the recording's time: gives times and points (T, 3) m."""
    times = begin + np.arange(frames) / rate
    points = np.array([0.02, 0.95, 0.0]) + sway(times)
    labels = ["time", *(f"pelvis_{axis}" for axis in "XYZ"), *(f"center_of_mass_{axis}" for axis in "XYZ")]
    storage(path, labels, np.concatenate([times[:, None], points, points * scale], axis=1))
    return times, points
