"""Miniature MoYo: sessions of short sequences with bodies, a pressure mat, centres of mass, cameras and images.

What the mat shows is worked out from where somebody stands in the world; the files say it in the mat's own way.
"""

from __future__ import annotations

import json
import pickle
import sys
import types
from unittest import mock

import numpy as np

from . import c3d_file

RATE = 60
ROWS, COLUMNS, CELL = 110, 37, 0.0127  # m
BEZEL = CELL  # the corner markers lie a cell outside the cells
BEGIN = 7  # the mat's recording begins so many maps before the cameras'
HANDS, COM = "20220923_20220926_with_hands", "20221004_with_com"
STANDING = np.array([np.pi / 2, 0, 0])  # turns SMPL-X's y up into the data set's z up


def _other_program():
    """The class of the fitting program's settings, omegaconf.dictconfig.DictConfig, and the modules that it is in."""
    module = types.ModuleType("omegaconf.dictconfig")
    module.DictConfig = type("DictConfig", (), {"__module__": module.__name__, "__qualname__": "DictConfig"})
    return module.DictConfig, {"omegaconf": types.ModuleType("omegaconf"), "omegaconf.dictconfig": module}


def body(path, frames, seed=0, lies=False, up="z", scale=1.0, **changes):
    """A *_stageii.pkl. Gives fullpose (F, 165) and trans (F, 3) as written."""
    rng = np.random.default_rng(seed)
    pose = rng.normal(scale=0.1, size=(frames, 165))
    pose[:, :3] = 0 if lies or up == "y" else STANDING
    trans = np.stack(
        [np.full(frames, 0.02), np.linspace(0, 0.1, frames), np.full(frames, 0.2 if lies else 1.25)], axis=1
    )
    if up == "y":
        trans = trans[:, [0, 2, 1]]
    settings, modules = _other_program()
    content = {
        "fullpose": pose,
        "trans": trans * scale,
        "betas": rng.normal(size=300),
        "markers_latent": rng.normal(size=(4, 3)),
        "latent_labels": ["LKNE", "RKNE", "C7", "T10"],
        "stageii_debug_details": {
            "cfg": settings(),
            "mocap_frame_rate": 60.0,
            "markers_obs": [rng.normal(size=(4, 3)) for _ in range(frames)],
            "labels_obs": [["LKNE", "RKNE", "C7", "T10"]] * frames,
            "stageii_errs": {"data": np.zeros(frames)},
        },
    }
    content |= changes
    content["stageii_debug_details"]["cfg"].settings = {"surface_model": {"type": "smplx", "gender": "female"}}
    with mock.patch.dict(sys.modules, modules):
        data = pickle.dumps({name: value for name, value in content.items() if value is not None})
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_bytes(data)
    return pose, trans


def pressed(frames, middle, turn=0.0):
    """Where somebody presses: force (F,) N, and maps (F, ROWS, COLUMNS) in N/cm², rows and columns counted from +x +y.

    Also the centre of pressure (F, 2) m in the world, for a mat whose middle is at `middle` (2,), turned by `turn`
    radians.
    """
    rng = np.random.default_rng(frames)
    maps = np.zeros((frames, ROWS, COLUMNS))
    for frame in range(frames):
        row, column = 40 + frame % 5, 10 + frame % 3
        maps[frame, row : row + 20, column : column + 8] = np.round(rng.uniform(0.5, 3, size=(20, 8)), 2)
    along, across = axes(turn)
    rows, columns = (np.arange(ROWS) + 0.5 - ROWS / 2) * CELL, (np.arange(COLUMNS) + 0.5 - COLUMNS / 2) * CELL
    force = maps.sum(axis=(1, 2)) * (100 * CELL) ** 2
    total = maps.sum(axis=(1, 2))
    center = (
        np.asarray(middle)
        + (maps.sum(axis=2) @ rows / total)[:, None] * along
        + (maps.sum(axis=1) @ columns / total)[:, None] * across
    )
    return force, maps, center


def axes(turn):
    """Unit vectors along the rows' and the columns' numbers: -y and -x of the room, for a mat that lies straight."""
    along = np.array([np.sin(turn), -np.cos(turn)])
    return along, np.array([-np.cos(turn), -np.sin(turn)])


def xml(path, maps, before=BEGIN, unit="N/cm2", cell=12.7, doctype="", entity=""):
    """The mat's XML: `before` empty maps, then these; each a crop, its last row first."""
    out = [
        f'<?xml version="1.0" encoding="UTF-8"?>\n{doctype}<myopressure>\n<measurement><cell_count><x>{COLUMNS}</x>'
        f"<y>{ROWS}</y></cell_count></measurement>\n<movements><movement><name>{entity}</name></movement>\n<clips><clip>"
        f"\n<cell_count><x>{COLUMNS}</x><y>{ROWS}</y></cell_count>\n<cell_size><x>{cell}</x><y>{cell}</y></cell_size>"
        f"\n<frequency>{RATE}</frequency>\n<count>{len(maps) + before}</count>\n<units>{unit}</units>\n<data>"
    ]
    for values in [*np.zeros((before, ROWS, COLUMNS)), *maps]:
        rows, columns = np.flatnonzero(values.any(axis=1)), np.flatnonzero(values.any(axis=0))
        first = (rows[0], columns[0]) if len(rows) else (0, 0)
        crop = values[first[0] : rows[-1] + 1, first[1] : columns[-1] + 1] if len(rows) else np.zeros((0, 0))
        lines = "".join(f"\n\t\t{' '.join(f'{value:.2f}' for value in row)}" for row in crop[::-1])
        out.append(
            f"<quant><cell_begin><x>{first[1]}</x><y>{first[0]}</y></cell_begin><cell_count><x>{crop.shape[1]}</x>"
            f"<y>{crop.shape[0]}</y></cell_count><cells>{lines}\n\t</cells></quant>"
        )
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text("\n".join([*out, "</data></clip></clips></movements></myopressure>\n"]))


def csv(path, force, maps, before=BEGIN, count=None):
    """The table of the frames that belong to the body's; centres of pressure in mm from the corner of cell (0, 0)."""
    total = maps.sum(axis=(1, 2))
    with np.errstate(invalid="ignore"):
        x = maps.sum(axis=1) @ (np.arange(COLUMNS) + 0.5) / total * CELL * 1000
        y = maps.sum(axis=2) @ (np.arange(ROWS) + 0.5) / total * CELL * 1000
    begin = "Pressure, Raw Pressure-distribution-Pressure center"
    lines = [
        "type,name,begin_time,frequency,count,units",
        f'single,"Yoga, barefoot",{before / RATE:.6f},{RATE},{len(maps) if count is None else count},mixed',
        "",
        f'time,Activity,"Force (N)","{begin}-x (mm)","{begin}-y (mm)"',
    ]
    for frame, values in enumerate(zip(force, x, y, strict=True)):
        cells = ",".join("" if np.isnan(value) else f"{value:.4f}" for value in values)
        lines.append(f"{(before + frame) / RATE:.6f},,{cells}")
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_bytes("\n".join([*lines, ""]).encode("utf-8-sig"))


def corners(path, frames, middle=(0.0, 0.0), turn=0.0, order=(2, 0, 3, 1), up="z", unit="mm"):
    """The c3d with the mat's corner markers and the body's; `order`: which corner has which marker."""
    along, across = axes(turn)
    half = np.array([ROWS, COLUMNS]) * CELL / 2 + BEZEL
    places = [np.asarray(middle) + i * half[0] * along + j * half[1] * across for i in (-1, 1) for j in (-1, 1)]
    points = np.array([[*places[number], 0.004] for number in order])
    points = points if up == "z" else points[:, [0, 2, 1]]
    markers = {"_03596:C7": np.tile([0.1, 0.0, 1.4], (frames, 1))}
    markers |= {f"SensorMat:M_{i + 1}": np.tile(point, (frames, 1)) for i, point in enumerate(points)}
    path.parent.mkdir(parents=True, exist_ok=True)
    c3d_file.write(path, markers, RATE, unit, up="+Z")


def com(path, frames, up="z", unit="mm", lost=()):
    """Vicon's centre of mass (F, 3) m and its foot on the floor; frames that are `lost` have none."""
    points = np.stack([np.linspace(0, 0.1, frames), np.zeros(frames), np.linspace(0.9, 1.0, frames)], axis=1)
    floor = points * [1, 1, 0]
    if up == "y":
        points, floor = points[:, [0, 2, 1]], floor[:, [0, 2, 1]]
    for values in (points, floor):
        values[list(lost)] = np.nan
    path.parent.mkdir(parents=True, exist_ok=True)
    c3d_file.write(path, {"PelvisCOM": points, "CentreOfMass": points, "CentreOfMassFloor": floor}, RATE, unit)
    return points


def camera(number):
    """Focal length, principal point, rotation (3, 3) from the room to the camera, position (3,) m."""
    position = np.array([3 * np.cos(number), 3 * np.sin(number), 1.5])
    forward = np.array([0, 0, 0.8]) - position
    forward /= np.linalg.norm(forward)
    right = np.cross(forward, [0, 0, 1])
    right /= np.linalg.norm(right)
    return 2000.0 + number, (1028.0, 752.0), np.stack([right, np.cross(forward, right), forward]), position


def cameras(session, day, scale=1000.0):
    path = session / "cameras" / f"20{day}" / f"{day}_PROCESSED" / "cameras_param.json"
    path.parent.mkdir(parents=True, exist_ok=True)
    said = {}
    for number in range(1, 9):
        focal, center, rotation, position = camera(number)
        said[f"cam_{number}"] = {
            "focal": focal,
            "princpt": list(center),
            "rotation": rotation.tolist(),
            "position": (position * scale).tolist(),
        }
    path.write_text(json.dumps(said))


def names(day="220923"):
    return [
        f"{day}_yogi_body_hands_03596_{pose}"
        for pose in ("Boat_Pose_-a", "Crane_(Crow)_Pose_or_Bakasana_-a", "Tree_-b")
    ]


def sequence(session, name, split="train", frames=24, with_com=False, seed=0):
    """All files of a sequence; gives its truth by name."""
    middle, turn = np.array([0.02, -0.05]) * (seed + 1), 0.01 * seed
    force, maps, center = pressed(frames, middle, turn)
    pose, trans = body(session / "mosh" / split / f"{name}_stageii.pkl", frames, seed)
    folder = session / "pressure" / split
    xml(folder / "xml" / f"{name}.xml", maps)
    csv(folder / "single_csv" / f"{name}.csv", force, maps)
    corners(folder / "pressure_mat_c3d" / f"{name}.c3d", frames, middle, turn)
    truth = {
        "pose": pose,
        "trans": trans,
        "force": force,
        "maps": maps,
        "center": center,
        "middle": middle,
        "turn": turn,
    }
    if with_com:
        truth["com"] = com(session / "com" / split / f"{name}.c3d", frames)
    return truth


def images(session, name, numbers, split="train", camera=1):
    folder = session / "images" / split / name / f"YOGI_Cam_{camera:02d}"
    folder.mkdir(parents=True, exist_ok=True)
    for number in numbers:
        (folder / f"{name}_YOGI_Cam_{camera:02d}_{number:04d}.jpg").write_bytes(b"")


def write(root):
    """Both sessions: two sequences in train and one in val each; gives the truth by sequence."""
    truth = {}
    for session, day, with_com in ((HANDS, "220923", False), (COM, "221004", True)):
        for seed, name in enumerate(names(day)):
            split = "val" if seed == 2 else "train"
            truth[name] = sequence(root / session, name, split, 20 + 2 * seed, with_com, seed)
        cameras(root / session, day)
        images(root / session, names(day)[0], range(3, 8))
    return truth
