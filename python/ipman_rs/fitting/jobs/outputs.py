"""The folder of each fitted item: parameters, mesh, how the fit went; and the study of what is in it.

`fit.json` is written last and says what the fit depended on: where it is and fits, the item is complete.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

import ipman_rs as ip

from ...body import BodyModel, pose_arrays
from ...files import read_json, safe_npz
from ...files.item_folder import RECORD as RECORD
from ...files.item_folder import npz as npz
from ...files.item_folder import write_files as write_files
from ...io import write_mesh
from ...study import Fitted, Study, camera_of, study
from .. import photo
from .items import Item

if TYPE_CHECKING:
    from ..result import FitResult

_BEFORE = "before_"
HELD = {
    "feet": "held up by its feet", "seat": "held up by a seat", "floor": "held up by the floor", "nothing": "moving",
}  # fmt: skip


@dataclass(frozen=True, eq=False)
class FittedItem:
    """One finished item: the arrays of its .npz file (`FitResult.arrays`), its posed vertices (V, 3) m, and the record
    of its fit.json."""

    item: Item
    arrays: dict[str, np.ndarray]
    vertices: np.ndarray
    record: dict[str, Any]


def write_item(
    item: Item, result: FitResult, body: BodyModel, folder: Path, record: dict[str, Any], obj: bool
) -> FittedItem:
    """Write one fitted body: parameters, mesh, and the record that makes its folder complete. Raises OSError."""
    arrays = result.arrays()
    vertices = posed(body, arrays)
    files: dict[str, Any] = {f"{item.name}.npz": arrays, f"{item.name}.glb": write_mesh.glb(vertices, body.faces)}
    if obj:
        files[f"{item.name}.obj"] = write_mesh.obj(vertices, body.faces)
    record = write_files(folder, files, {"name": item.name, "source": item.source, **record})
    return FittedItem(item, arrays, vertices, record)


def read_item(item: Item, body: BodyModel, folder: Path, identity: str) -> FittedItem | None:
    """An item that an earlier run finished with the same input and options, or None."""
    finished = read_finished(folder / f"{item.name}.npz", identity)
    if finished is None:
        return None
    arrays, record = finished
    return FittedItem(item, arrays, posed(body, arrays), record)


def read_finished(path: Path, identity: str) -> tuple[dict[str, np.ndarray], dict[str, Any]] | None:
    """The arrays of an .npz and the record beside it, of a fit that was finished with the same input and options; None
    where there is none, or a file of it is missing or damaged."""
    try:
        record = read_json(path.parent / RECORD)
        fits = record["identity"] == identity
        there = all((path.parent / name).is_file() for name in record["files"])
        arrays = {name: safe_npz.read(path, name) for name in safe_npz.names(path)} if fits and there else {}
    except (OSError, ValueError, KeyError, TypeError):
        return None
    return (arrays, record) if arrays else None


def posed(body: BodyModel, arrays: dict[str, np.ndarray], prefix: str = "") -> np.ndarray:
    """The vertices (V, 3) of stored parameters."""
    pose = pose_arrays.joined(arrays, body, prefix)
    betas, transl, expression = (arrays.get(prefix + name) for name in ("betas", "transl", "expression"))
    rows = (None if each is None else each[0] for each in (betas, transl, expression))
    return np.asarray(body(pose, *rows).vertices)


def study_of(fitted: FittedItem, body: BodyModel, pictured: bool) -> Study:
    """The analysed body of a finished item; with its photo and the body before the physics terms if it is pictured."""
    item, arrays, vertices, record = fitted.item, fitted.arrays, fitted.vertices, fitted.record
    known = "ground_height" in arrays
    ground = ip.Ground(arrays["ground_normal"][0], arrays["ground_height"][0]) if known else ip.Ground.under(vertices)
    before = None
    if pictured and f"{_BEFORE}betas" in arrays:
        before = study("Before the physics terms", posed(body, arrays, _BEFORE), body.template, ground)
    shown = Fitted(
        camera=camera_of(*(arrays[name][0] for name in ("camera_rotation", "camera_translation", "focal", "center"))),
        size=tuple(arrays["image_size"][0]),
        seen=arrays["keypoints"][0],
        projected=arrays["projected"][0],
        photo=photo.read(item.photo) if pictured and item.photo is not None else None,
        before=before,
        pictured=pictured,
        record={key: value for key, value in record.items() if key not in ("name", "source")},
    )
    analyzed = study(item.name, vertices, body.template, ground, source=item.source, notes=notes(record))
    return replace(analyzed, flags=tuple(record["flags"]), fitted=shown)


def notes(record: dict[str, Any]) -> list[str]:
    """What the report says under a body's name."""
    said = "converged" if record["converged"] else f"did not converge ({record['reason']})"
    lines = [f"fit: preset {record['preset']}, {said} after {record['iterations']} iterations"]
    if "presented" in record:
        lines.append(_presented(record["presented"]))
    errors = record["reprojection"]
    lines += [f"reprojection: median {errors['median_px']:.1f} px, {errors['median_percent']:.1f} % of the height"]
    if "support" in record["confidence"]:
        lines.append(_explanation(record["confidence"]))
    return [*lines, *record["notes"]]


def _explanation(confidence: dict[str, Any]) -> str:
    """The hypothesis that was chosen, in words."""
    held = HELD[confidence["support"]]
    if "camera_pitch" not in confidence:
        return held
    low, high = confidence["camera_pitch_range"]
    also = f" ({low:.0f} to {high:.0f}° explain the image alike)" if low < high else ""
    down = confidence["camera_pitch"]
    return f"{held}; the camera looks {'up' if down < 0 else 'down'} by {abs(down):.0f}°{also}"


def _presented(shown: dict[str, Any]) -> str:
    by = {"mesh": "found on it", "file": "by its file", "given": "as given"}[shown["contact_from"]]
    height, above = shown["body_height_m"], 1000 * shown["lowest_above_floor_m"]
    said = f"presented pose: {shown['source']}, {height:.2f} m tall, its lowest point {above:.0f} mm above its floor"
    return f"{said}; {shown['contact_vertices']} vertices touch ({by})"
