"""A scanned scene of RICH: its cameras, and the ground of the laser scan in the axes of camera 0."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ipman_rs.files import read_json
from ipman_rs.files.mesh.read_mesh import read_points
from ipman_rs.ground import Ground

from ..files import safe_xml

Array = NDArray[np.float64]

TILT = 30.0  # degrees: more than that from the scan's z is no ground


@dataclass(frozen=True, eq=False)
class RichScene:
    """What belongs to a place: its ground in camera 0's axes, and its cameras' rotation, translation, intrinsics."""

    ground: Ground | None
    cameras: dict[int, tuple[Array, Array, Array]]


def calibration_folder(root: Path, folder: Path) -> Path:
    return root / "scan_calibration" / folder.name.partition("_")[0] / "calibration"


def to_world_file(root: Path, folder: Path) -> Path:
    """The file that leads to the scan's world; the lecture hall was scanned twice."""
    scene = folder.name.partition("_")[0]
    if scene == "LectureHall":
        scene += "_chair" if "chair" in folder.name else "_yoga"
    return root / "multicam2world" / f"{scene}_multicam2world.json"


def ground_mesh_file(root: Path, folder: Path) -> Path | None:
    scene = folder.name.partition("_")[0]
    places = (folder / "ground_mesh.ply", root / "scan_calibration" / scene / "ground_mesh.ply")
    return next((place for place in places if place.is_file()), None)


def scene_files(root: Path, folder: Path) -> tuple[Path | None, Path, Path]:
    """Ground, way to the scan's world, and folder of the cameras' calibrations."""
    return ground_mesh_file(root, folder), to_world_file(root, folder), calibration_folder(root, folder)


def read_scene(mesh: Path | None, to_world: Path, calibration: Path) -> RichScene:
    files = sorted(file for file in calibration.glob("*.xml") if file.stem.isdigit())
    return RichScene(
        ground=None if mesh is None else ground(mesh, to_world),
        cameras={int(file.stem): camera(file) for file in files},
    )


def camera(file: Path) -> tuple[Array, Array, Array]:
    """Rotation (3, 3), translation (3,) m and intrinsics (3, 3) pixels of a calibration's XML.

    ValueError, naming the file, for a document type and for what is damaged or cannot be.
    """
    root = safe_xml.read(file)
    extrinsics, intrinsics = (
        _matrix(root, name, size, file) for name, size in (("CameraMatrix", 12), ("Intrinsics", 9))
    )
    rotation, translation = extrinsics.reshape(3, 4)[:, :3], extrinsics.reshape(3, 4)[:, 3]
    if np.abs(rotation @ rotation.T - np.eye(3)).max() > 1e-3 or np.linalg.det(rotation) < 0:
        raise ValueError(f"{file}: CameraMatrix: expected a rotation, got {rotation.round(3).tolist()}")
    if np.linalg.norm(translation) > 100:
        raise ValueError(f"{file}: CameraMatrix: looks like millimetres: {translation.tolist()}, expected metres")
    return rotation, translation, intrinsics.reshape(3, 3)


def _matrix(root: Any, name: str, size: int, file: Path) -> Array:
    words = safe_xml.text(root, f"{name}/data", file).split()
    try:
        numbers = np.array(words, np.float64)
    except ValueError as error:
        raise ValueError(f"{file}: {name}: expected numbers: {error}") from None
    if numbers.size != size or not np.isfinite(numbers).all():
        raise ValueError(f"{file}: {name}: expected {size} finite numbers, got {numbers.size}")
    return numbers


def ground(mesh: Path, to_world: Path) -> Ground:
    """The plane through the scan's ground, in camera 0's axes.

    ValueError, naming the file, for what is missing or damaged, or a ground that is not level in a world that is z up.
    """
    try:
        points = read_points(mesh)
    except ValueError as error:
        raise ValueError(f"{mesh}: expected a mesh: {str(error).removeprefix(f'{mesh}: ')}") from error
    if len(points) < 3:
        raise ValueError(f"{mesh}: expected three vertices or more, got {len(points)}")
    if np.abs(points).max() > 1000:
        raise ValueError(f"{mesh}: looks like millimetres: vertices up to {np.abs(points).max():.4g} from the origin")
    middle = points.mean(axis=0)
    normal = np.linalg.svd(points - middle, full_matrices=False)[2][2]
    normal = normal if normal[2] > 0 else -normal
    tilt = np.degrees(np.arccos(min(abs(normal[2]), 1.0)))
    if tilt > TILT:
        axis = "xyz"[int(np.abs(normal).argmax())]
        raise ValueError(f"{mesh}: looks like {axis} up: the ground leans {tilt:.0f}° from the scan's z, its up axis")
    rotation, translation, scale = _transform(to_world)
    # normal · (c X R + t) = normal · middle, for a row X
    return Ground(rotation @ normal, float(normal @ (middle - translation)) / scale)


def _transform(file: Path) -> tuple[Array, Array, float]:
    """R, t and c of world = c · X R + t."""
    content = read_json(file)
    try:
        rotation, translation = np.array(content["R"], float), np.array(content["t"], float).reshape(3)
        scale = float(np.array(content["c"], float).reshape(()))
    except (ValueError, LookupError, TypeError, OverflowError) as error:
        raise ValueError(f"{file}: expected R, t and c of the way to the scan's world: {error!r}") from None
    if rotation.shape != (3, 3) or np.abs(rotation @ rotation.T - np.eye(3)).max() > 1e-3:
        raise ValueError(f"{file}: R: expected a rotation (3, 3), got {rotation.tolist()}")
    if not 0.5 < scale < 2:
        hint = ": looks like millimetres" if scale > 100 or 0 < scale < 0.01 else ""
        raise ValueError(f"{file}: c{hint}: expected a scale about 1, metres to metres, got {scale:g}")
    return rotation, translation, scale
