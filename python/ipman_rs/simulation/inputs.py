"""The bodies that `ipman simulate` drops: a file as `ipman analyze` reads it, predictions, or a folder of fits.

Predictions and fits bring a ground of their own; `up` or `ground` take its place.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

import ipman_rs as ip

from ..body import embedded
from ..files import safe_npz
from ..files.errors import FileError
from ..fitting.jobs.outputs import RECORD
from ..io.body_sequence import BodySequence
from ..progress import Progress, silent
from ..study.from_file import Request, add_unit_warning, collect_unit_warnings, on_ground

_BESIDE = ("names", "body", "model", "ground", "ground_normal", "ground_height")  # arrays beside the parameters
PREDICTIONS = "predictions.npz"  # what `ipman predict --data` and `ipman fit --data` leave in their folder


@dataclass(frozen=True)
class GroundedBodies:
    """T bodies of a file on a ground, which is one for all or one for each. names: (T,) where they have any; flags:
    warnings about them."""

    path: Path
    recording: BodySequence
    template: Any
    ground: ip.Ground
    names: tuple[str, ...] | None
    notes: Sequence[str]
    flags: tuple[str, ...] = ()

    @property
    def count(self) -> int:
        return len(self.recording.vertices)


def read_bodies(path: Path, request: Request, progress: Progress = silent) -> GroundedBodies:
    """The bodies of a file or folder; warnings about them are in `flags`. Raises FileError."""
    try:
        with collect_unit_warnings() as sizes:
            if path.is_dir() and not (path / PREDICTIONS).is_file():
                bodies = _fits(path, request, progress)
            else:
                bodies = replace(_file(path / PREDICTIONS if path.is_dir() else path, request, progress), path=path)
    except (ValueError, TypeError) as error:
        raise FileError(path, str(error)) from error
    except MemoryError as error:
        raise FileError(path, "needs more memory than there is; simulate fewer frames at once") from error
    return replace(bodies, flags=add_unit_warning(bodies.flags, sizes))


def _file(path: Path, request: Request, progress: Progress) -> GroundedBodies:
    arrays = _arrays(path) if path.suffix.lower() == ".npz" and path.is_file() and path.stat().st_size else {}
    request = _with_model(path, request, arrays)
    own = _own_ground(path, arrays, request.units) if request.up is None and request.ground is None else None
    recording, template, ground, notes = on_ground(path, request, own, _BESIDE, progress)
    count = len(recording.vertices)
    if own is not None and own.height.size not in (1, count):
        raise FileError(path, f"has {own.height.size} grounds for {count} bodies; expected one, or one for each")
    if "names" in arrays and arrays["names"].shape != (count,):
        raise FileError(path, f"names have shape {arrays['names'].shape}; expected one for each of {count} bodies")
    names = tuple(arrays["names"].astype(str).tolist()) if "names" in arrays else None
    return GroundedBodies(path, recording, template, ground, names, notes, recording.flags)


def _arrays(path: Path) -> dict[str, np.ndarray]:
    """What a file says of its bodies beside their parameters."""
    try:
        stored = safe_npz.names(path)
        return {name: safe_npz.read(path, name) for name in _BESIDE if name in stored}
    except ValueError as error:
        raise FileError(path, str(error)) from error


def _with_model(path: Path, request: Request, arrays: dict[str, np.ndarray]) -> Request:
    """The request with the body model that the file names. Of one that is not included the user must name the file."""
    named = next((str(arrays[key]) for key in ("body", "model") if key in arrays), None)
    if request.model is not None or named is None:
        return request
    if named not in embedded.NAMES:
        raise FileError(path, f"its bodies are of {named!r}, which is not included; name the model's file with `model`")
    return replace(request, model=named)


def _own_ground(path: Path, arrays: dict[str, np.ndarray], metres: float) -> ip.Ground | None:
    """From `ground` (normal and height, of predictions) or `ground_normal` and `ground_height` (of a fit)."""
    if "ground" in arrays:
        rows = arrays["ground"]
        if rows.ndim not in (1, 2) or rows.shape[-1] != 4 or not len(rows):
            raise FileError(path, f"ground has shape {rows.shape}; expected normal and height, (4,) or (T, 4)")
        normal, height = rows[..., :3], rows[..., 3]
    elif {"ground_normal", "ground_height"} <= arrays.keys():
        normal, height = arrays["ground_normal"], arrays["ground_height"]
    else:
        return None
    try:
        normal, height = normal.reshape(-1, 3), metres * height.reshape(-1)
        return ip.Ground(normal[0], height[0]) if len(normal) == len(height) == 1 else ip.Ground(normal, height)
    except ValueError as error:
        raise FileError(path, str(error)) from error


def _fits(folder: Path, request: Request, progress: Progress) -> GroundedBodies:
    """The bodies of a folder of `ipman fit`, in the order of their names."""
    items = [record.parent for record in sorted(folder.glob(f"*/{RECORD}"))]
    if not items:
        raise FileError(folder, f"holds neither {PREDICTIONS} nor finished fits; name a file, or a folder of ipman fit")
    each = [_file(item / f"{item.name}.npz", request, progress) for item in items]
    first = each[0]
    for item, other in zip(items, each, strict=True):
        faces = other.recording.faces
        if faces.shape != first.recording.faces.shape or (faces != first.recording.faces).any():
            raise FileError(item, f"is another body than {items[0].name}; expected fits of one body model")
    counts = [len(one.recording.vertices) for one in each]
    names = [
        item.name if count == 1 else f"{item.name} {frame}"
        for item, count in zip(items, counts, strict=True)
        for frame in range(count)
    ]
    normals = [np.broadcast_to(one.ground.normal, (count, 3)) for one, count in zip(each, counts, strict=True)]
    heights = [np.broadcast_to(one.ground.height, (count,)) for one, count in zip(each, counts, strict=True)]
    vertices = np.concatenate([np.asarray(one.recording.vertices[:]) for one in each])
    return GroundedBodies(
        folder,
        replace(first.recording, path=folder, vertices=vertices, seconds=None),
        first.template,
        ip.Ground(np.concatenate(normals), np.concatenate(heights)),
        tuple(names),
        flags=tuple(f"{item.name}: {flag}" for item, one in zip(items, each, strict=True) for flag in one.flags),
        notes=[*first.notes, f"bodies: {len(names)} from {len(items)} fits, each on its own ground"],
    )
