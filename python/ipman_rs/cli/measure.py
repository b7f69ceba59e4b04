"""From a file and the options to a study: read it, find its parts and its ground, analyse it."""

from __future__ import annotations

import warnings
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

import ipman_rs as ip

from .. import view
from . import console
from .errors import FileError
from .meshes import read_mesh
from .parameters import read_npz
from .parts import match_body, read_parts
from .recording import Recording


@dataclass(frozen=True)
class Request:
    """The options that every body of one command shares."""

    model: str = "anny"
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
    recording = read(path, request.model)
    template, notes = _template(recording, request)
    normal = request.up or recording.up
    notes = [*recording.notes, *notes]
    if request.up is None:
        notes.append(f"up: {recording.up_name} (assumed{recording.up_why}; --up says otherwise)")
    height = request.ground
    if height is None:
        heights = recording.vertices.astype(np.float64) @ ip.Ground(normal).normal
        if not np.isfinite(heights).any():
            raise FileError(path, "no vertex is a finite number; export it again")
        height = float(heights[np.isfinite(heights)].min())
        whole = "of all frames " if len(recording.vertices) > 1 else ""
        where = f"{round(height, 4) + 0.0:+.4f} m"
        notes.append(f"ground: through the lowest vertex {whole}({where}; --ground HEIGHT says otherwise)")
    if template.num_parts == 1:
        notes.append("one part: the centre of mass is the exact one of the volume, not the paper's part-wise pCoM")
    if not template.watertight:
        notes.append("open mesh: its holes are closed by fans before volumes are measured")
    with console.progress(f"analysing {path.name}", len(recording.vertices)) as step:
        return view.study(
            path.stem, recording.vertices, template, ip.Ground(normal, height), request.preset,
            seconds=recording.seconds, source=str(path), notes=notes, progress=step.to,
        )  # fmt: skip


def read(path: Path, model: str) -> Recording:
    """The bodies in a file, by the ending of its name."""
    if not path.is_file():
        what = "is a folder; name the files in it" if path.is_dir() else "there is no such file"
        raise FileError(path, what)
    if path.stat().st_size == 0:
        raise FileError(path, "is empty; export it again")
    if path.suffix.lower() == ".npz":
        return read_npz(path, model)
    return read_mesh(path)


def _template(recording: Recording, request: Request) -> tuple[Any, list[str]]:
    """The template of a recording, and where its parts come from."""
    vertices, faces = recording.vertices, recording.faces
    if recording.template is not None and request.parts is None:
        return recording.template, []
    finite = np.flatnonzero(np.isfinite(vertices).all(axis=(1, 2)))
    if len(finite) == 0:
        raise FileError(recording.path, "no frame has finite vertices only; export it again")
    if request.parts is not None:
        face_parts, names = read_parts(request.parts, faces, recording.vertex_map)
        template = ip.BodyTemplate(vertices[finite[0]], faces, face_parts, names)
        return template, [f"parts: {len(names)} from {request.parts}"]
    body = match_body(faces, vertices.shape[1], request.model)
    if body is not None:
        return body.template, [f"parts: the {len(body.part_names)} of the body {body.name}, whose topology it has"]
    template = ip.BodyTemplate(vertices[finite[0]], faces)
    return template, ["parts: none known, so it is analysed as one part (--parts FILE names them)"]
