"""From a file and the options to a study: read it, find its parts and its ground, analyse it."""

from __future__ import annotations

import warnings
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

import ipman_rs as ip

from .. import view
from ..analysis import PIECE
from ..body.sequence import pieces
from ..files import regular
from . import console
from .errors import FileError
from .meshes import read_mesh
from .parameters import read_npz
from .parts import match_body, read_parts
from .recording import Recording


@dataclass(frozen=True)
class Request:
    """The options that every body of one command shares."""

    model: str | None = None  # the one that a file names, or anny
    up: tuple[float, float, float] | None = None
    ground: float | None = None
    parts: Path | None = None
    preset: str = "paper-r"


def measure(path: Path, request: Request) -> view.Study:
    """Analyse one file. Raises FileError; warnings about units go to stderr as one line."""
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("ignore")
        warnings.simplefilter("always", ip.UnitsWarning)
        try:
            study = _measure(path, request)
        except (ValueError, TypeError) as error:
            raise FileError(path, str(error)) from error
        except MemoryError as error:
            raise FileError(path, "needs more memory than there is; analyse fewer frames at once") from error
    for warning in caught[:1]:
        console.warn(f"{path}: {warning.message}")
    return study


def _measure(path: Path, request: Request) -> view.Study:
    recording, template, ground, notes = on_ground(path, request)
    if template.num_parts == 1:
        notes.append("one part: the centre of mass is the exact one of the volume, not the paper's part-wise pCoM")
    if not template.watertight:
        notes.append("open mesh: its holes are closed by fans before volumes are measured")
    with console.progress(f"analysing {path.name}", len(recording.vertices)) as step:
        return view.study(
            path.stem, recording.vertices, template, ground, request.preset,
            seconds=recording.seconds, source=str(path), notes=notes, progress=step.to,
        )  # fmt: skip


def on_ground(path: Path, request: Request) -> tuple[Recording, Any, ip.Ground, list[str]]:
    """The bodies of a file, their template and ground, and what was assumed. Raises FileError."""
    recording = read(path, request.model)
    template, notes = _template(recording, request)
    normal = request.up or recording.up
    notes = [*recording.notes, *notes]
    if request.up is None:
        notes.append(f"up: {recording.up_name} (assumed{recording.up_why}; --up says otherwise)")
    height = request.ground
    if height is None:
        height = _lowest(recording, ip.Ground(normal).normal)
        if not np.isfinite(height):
            raise FileError(path, "no vertex is a finite number; export it again")
        whole = "of all frames " if len(recording.vertices) > 1 else ""
        where = f"{round(height, 4) + 0.0:+.4f} m"
        notes.append(f"ground: through the lowest vertex {whole}({where}; --ground HEIGHT says otherwise)")
    return recording, template, ip.Ground(normal, height), notes


def read(path: Path, model: str | None) -> Recording:
    """The bodies in a file, by the ending of its name."""
    try:
        regular(path)
    except ValueError as error:
        raise FileError(path, str(error)) from None
    if path.stat().st_size == 0:
        raise FileError(path, "is empty; export it again")
    if path.suffix.lower() == ".npz":
        return read_npz(path, model)
    return read_mesh(path)


def _lowest(recording: Recording, normal: np.ndarray) -> float:
    """The least finite height along the normal; infinite if there is none."""
    lowest = np.inf
    with console.progress(f"finding the ground of {recording.path.name}", len(recording.vertices)) as step:
        done = 0
        for vertices in pieces(recording.vertices, PIECE):
            heights = _heights(vertices, normal)
            least = heights.min()
            if not np.isfinite(least):
                least = heights.min(initial=np.inf, where=np.isfinite(heights))
            lowest = min(lowest, float(least))
            done += len(vertices)
            step.to(done)
    return lowest


def _heights(vertices: np.ndarray, normal: np.ndarray) -> np.ndarray:
    """normal · vertex of each, summed in one order whatever the number of bodies, which a matrix product does not."""
    axis = int(np.argmax(normal))
    if normal[axis] == 1.0:
        return vertices[..., axis]
    x, y, z = (vertices[..., k].astype(np.float64) * normal[k] for k in range(3))
    return x + y + z


def _template(recording: Recording, request: Request) -> tuple[Any, list[str]]:
    """The template of a recording, and where its parts come from."""
    faces = recording.faces
    if recording.template is not None and request.parts is None:
        return recording.template, []
    frames = (frame for piece in pieces(recording.vertices, PIECE) for frame in piece)
    first = next((frame.copy() for frame in frames if np.isfinite(frame).all()), None)
    if first is None:
        raise FileError(recording.path, "no frame has finite vertices only; export it again")
    if request.parts is not None:
        face_parts, names = read_parts(request.parts, faces, recording.vertex_map)
        template = ip.BodyTemplate(first, faces, face_parts, names)
        return template, [f"parts: {len(names)} from {request.parts}"]
    body = match_body(faces, len(first), request.model or "anny")
    if body is not None:
        return body.template, [f"parts: the {len(body.part_names)} of the body {body.name}, whose topology it has"]
    template = ip.BodyTemplate(first, faces)
    return template, ["parts: none known, so it is analysed as one part (--parts FILE names them)"]
