"""The frames of a MoYo sequence: the body, the centre of mass, and what the mat measured."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ipman_rs.files import safe_pickle
from ipman_rs.ground import Ground

from .. import c3d, sequences
from ..frames import Frames, PressureMaps
from .files import SequenceFiles
from .mat import RATE, corners, place_maps, read_maps, read_trace

Array = NDArray[np.float64]

CELLS, CELL = (110, 37), 0.0127  # the mat's rows and columns, and their size in m
APART = 2  # frames by which recordings of one sequence may differ in length: an image's time
BROKEN_MAT = "_body_hands_03596_Cow_Face_Pose_or_Gomukhasana_-c"  # left out by the authors, too
COM, COM_FLOOR = "CentreOfMass", "CentreOfMassFloor"


def read_body(files: SequenceFiles) -> Frames:
    """The body alone."""
    path = files.mosh
    content = safe_pickle.read(path, "body of MoYo", "an unmodified file of its mosh folder", tolerant=True)

    def array(name: str, shape: tuple[int, ...]) -> Array:
        if name not in content:
            raise ValueError(f"{path}: no {name} in it (it has {', '.join(sorted(map(str, content)))})")
        try:
            values = safe_pickle.as_array(content[name])
        except ValueError as error:
            raise ValueError(f"{path}: {name}: {error}") from error
        fits = values.ndim == len(shape) and all(w in (-1, g) for w, g in zip(shape, values.shape, strict=True))
        if not fits or values.dtype.kind not in "fiu":
            wanted = ", ".join("any" if size == -1 else str(size) for size in shape)
            raise ValueError(f"{path}: {name}: expected numbers ({wanted}), got {values.dtype} {values.shape}")
        return values.astype(np.float64)

    pose = array("fullpose", (-1, 165))
    count = len(pose)
    if not count:
        raise ValueError(f"{path}: expected frames, the sequence is empty")
    transl, betas = array("trans", (count, 3)), array("betas", (-1,))
    frames = Frames(
        names=sequences.frame_names(files.name, count),
        sequences=np.full(count, files.name),
        ground=Ground.z_up(),
        frame_rate=RATE,
        body="smplx",
        genders=np.full(count, "female"),
        pose=pose.reshape(count, 55, 3),
        betas=np.broadcast_to(betas, (count, len(betas))),
        transl=transl,
    )
    return sequences.require_plausible_units(path, frames)


def read_frames(files: SequenceFiles, with_pressure: bool, with_com: bool) -> Frames:
    frames = read_body(files)
    count = len(frames)
    if with_com:
        com = _center_of_mass(files.com, count) if files.com.is_file() else np.full((count, 3), np.nan)
        frames = replace(frames, center_of_mass=com)
    if with_pressure:
        frames = _with_mat(files, frames)
    return frames


def _center_of_mass(path: Path, count: int) -> Array:
    """(count, 3) m, NaN where Vicon has none."""
    points = c3d.read(path).positions([COM, COM_FLOOR])
    points[(points == 0).all(axis=-1)] = np.nan
    centers, floor = _pad_rows(path, "frames", points, count).swapaxes(0, 1)
    both = np.isfinite(floor).all(axis=1) & np.isfinite(centers).all(axis=1)
    if not both.any():
        return centers
    off = np.median(np.abs(floor - centers)[both], axis=0)
    if off[:2].max() > 0.02 or abs(np.median(floor[both, 2])) > 0.05:
        axis = "xyz"[int(off.argmax())]
        raise ValueError(
            f"{path}: looks like {axis} up: {COM_FLOOR} is expected under {COM}, on z = 0, but lies "
            f"({', '.join(f'{number:.2f}' for number in off)}) m from it"
        )
    return centers


def _pad_rows(path: Path, what: str, values: NDArray[Any], count: int) -> NDArray[Any]:
    """`values` with `count` rows: one or two may be missing at the end, or be too many."""
    if abs(len(values) - count) > APART:
        raise ValueError(
            f"{path}: expected {count} {what}, as many as the body has, give or take {APART}, got {len(values)}"
        )
    lacking = max(count - len(values), 0)
    more = np.full((lacking, *values.shape[1:]), np.nan, values.dtype)
    return np.concatenate([values[:count], more])


def _with_mat(files: SequenceFiles, frames: Frames) -> Frames:
    """The frames with the mat's maps, centre of pressure and force; NaN if the sequence has no files of the mat."""
    maps_file, trace_file, corners_file = files.mat
    count = len(frames)
    if not maps_file.is_file() or (files.name.endswith(BROKEN_MAT) and "_nexus_" not in files.name):
        nothing, nowhere = np.full((count, 3), np.nan), np.full(3, np.nan)
        maps = PressureMaps(np.full((count, *CELLS), np.nan, np.float32), nowhere, nowhere, nowhere, CELL)
        return replace(frames, center_of_pressure=nothing, forces=nothing[:, None], pressure=maps)
    mat, trace = read_maps(maps_file), read_trace(trace_file)
    if mat.rate != trace.rate or trace.maps[0] < 0 or trace.maps[-1] >= len(mat.maps):
        raise ValueError(
            f"{trace_file}: expected times of the {len(mat.maps)} maps of {maps_file.name} at {mat.rate:g} Hz, got "
            f"maps {trace.maps[0]} to {trace.maps[-1]} at {trace.rate:g} Hz"
        )
    placed = place_maps(mat, corners(corners_file), corners_file)
    center = placed.origin + trace.center[:, 1:] * placed.e1 + trace.center[:, :1] * placed.e2
    force = np.stack([np.zeros_like(trace.force), np.zeros_like(trace.force), trace.force], axis=1)
    maps = _pad_rows(trace_file, "rows", placed.values[trace.maps], count)
    return replace(
        frames,
        center_of_pressure=_pad_rows(trace_file, "rows", center, count),
        forces=_pad_rows(trace_file, "rows", force, count)[:, None],
        pressure=replace(placed, values=maps),
    )
