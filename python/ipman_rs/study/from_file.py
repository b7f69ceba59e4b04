"""From a file and the options to a study: read it, find its parts and its ground, analyse it."""

from __future__ import annotations

import warnings
from collections.abc import Collection, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

import ipman_rs as ip

from .. import presets, spellings
from ..analysis import PIECE
from ..body.sequence import pieces
from ..data import check, plausibility, separate_pieces
from ..data.check import Finding
from ..files import regular_file, safe_npz
from ..files.errors import FileError
from ..io.body_sequence import BodySequence
from ..io.meshes import read_mesh
from ..io.parameters import read_npz
from ..io.parts import match_body, read_parts
from ..progress import Progress, silent
from .study import Study, study

Arrays = Mapping[str, np.ndarray]

SAMPLED_VERTICES = 800_000  # of the bodies that are checked: 65 of the embedded one, a fraction of a second
WEIGHED = 16  # bodies
LISTED = 12  # names of arrays


@dataclass(frozen=True)
class Request:
    """The options that every body of one command shares, as numbers or as the words of the command line
    (`ipman_rs.spellings`), which become numbers.

    model: name or file; None: the one that a file names, or anny. up: an axis such as "-z", or a normal; None: y, or z
    of AMASS files. ground: m along it; None or "auto": the lowest vertex. parts: a file of body parts. units: "mm", or
    metres in one of the files' lengths. rate: Hz, instead of the files'. force: what cannot be a person is let in, too.

    Raises:
        ValueError: what is none of these; the message names the argument.
    """

    model: str | None = None
    up: spellings.Spelled | None = None
    ground: spellings.Spelled | None = None
    parts: str | Path | None = None
    preset: str = "paper-r"
    units: spellings.Spelled = 1.0
    degrees: bool = False
    rate: spellings.Spelled | None = None
    force: bool = False

    def __post_init__(self) -> None:
        presets.get(self.preset)
        spellings.read_fields(
            self, up=spellings.axis, ground=spellings.height_or("auto"), units=spellings.unit, rate=spellings.rate,
            parts=Path,
        )  # fmt: skip


_DEFAULT = Request()


def analyze_file(
    path: str | Path, request: Request = _DEFAULT, progress: Progress = silent, arrays: Arrays | None = None
) -> Study:
    """The study of the bodies in one file; warnings about them are in its flags.

    arrays: what an .npz file holds, by a caller that has just written it; then the file is not read.

    Raises:
        FileError: the file cannot be read, or what it holds cannot be a person (`Request.force` lets it in).
    """
    path = Path(path)
    with collect_unit_warnings() as found:
        try:
            analysed = _analyzed(path, request, progress, arrays)
        except (ValueError, TypeError) as error:
            raise FileError(path, str(error)) from error
        except MemoryError as error:
            raise FileError(path, "needs more memory than there is; analyse fewer frames at once") from error
    return replace(analysed, flags=add_unit_warning(analysed.flags, found))


@contextmanager
def collect_unit_warnings() -> Iterator[list[str]]:
    """Collects the `UnitsWarning`s about bodies too large or too small for metres as text, instead of warning."""
    said: list[str] = []
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("ignore")
        warnings.simplefilter("always", ip.UnitsWarning)
        yield said
    said += [str(warning.message) for warning in caught]


def add_unit_warning(flags: Sequence[str], sizes: Sequence[str]) -> tuple[str, ...]:
    """The flags, with the first unit warning unless a flag already concerns the vertices."""
    said = any(flag.startswith("vertices:") for flag in flags)
    return (*flags, *([] if said else sizes[:1]))


def _analyzed(path: Path, request: Request, progress: Progress, arrays: Arrays | None) -> Study:
    recording, template, ground, notes = on_ground(path, request, progress=progress, arrays=arrays)
    if template.num_parts == 1:
        notes.append("one part: the centre of mass is the exact one of the volume, not the paper's part-wise pCoM")
    if not template.watertight:
        notes.append("open mesh: its holes are closed by fans before volumes are measured")
    with progress(f"analysing {path.name}", len(recording.vertices)) as step:
        return study(
            path.stem, recording.vertices, template, ground, request.preset, seconds=recording.seconds,
            source=str(path), notes=notes, flags=recording.flags, progress=step.to,
        )  # fmt: skip


def on_ground(
    path: Path,
    request: Request,
    own: ip.Ground | None = None,
    read_elsewhere: Collection[str] = (),
    progress: Progress = silent,
    arrays: Arrays | None = None,
) -> tuple[BodySequence, Any, ip.Ground, list[str]]:
    """The bodies of a file, checked, their template and ground, and what was assumed. Raises FileError.

    own: the ground that the file itself gives. read_elsewhere: arrays of the file that the caller reads. arrays: as for
    `analyze_file`.
    """
    recording = read(path, request) if arrays is None else _parameters(path, request, arrays)
    admitted = plausibility.admit(path, recording.findings, request.force)
    template, notes = _template(recording, request)
    normal = request.up or recording.up if own is None else np.atleast_2d(own.normal)[0]
    findings = _findings(recording, template, np.asarray(normal), request.up is not None or own is not None)
    recording = replace(recording, flags=(*admitted, *plausibility.admit(path, findings, request.force)))
    notes = [*recording.notes, *notes, *_not_used(recording, read_elsewhere)]
    if own is not None:
        return recording, template, own, [*notes, "ground: the file's own (`up` and `ground` say otherwise)"]
    if request.up is None:
        notes.append(f"up: {recording.up_name} (assumed{recording.up_why}; `up` says otherwise)")
    height = request.ground
    if height is None:
        height = _lowest(recording, ip.Ground(normal).normal, progress)
        if not np.isfinite(height):
            raise FileError(path, "no vertex is a finite number; export it again")
        whole = "of all frames " if len(recording.vertices) > 1 else ""
        where = f"{round(height, 4) + 0.0:+.4f} m"
        notes.append(f"ground: through the lowest vertex {whole}({where}; `ground=HEIGHT` says otherwise)")
    return recording, template, ip.Ground(normal, height), notes


def _findings(recording: BodySequence, template: Any, normal: np.ndarray, up_is_said: bool) -> list[Finding]:
    """Of some bodies of a file, evenly spaced."""
    count, size = recording.vertices.shape[:2]
    few = np.asarray(recording.vertices[check.evenly(count, max(1, min(check.SAMPLE, SAMPLED_VERTICES // size)))])
    findings = plausibility.bodies(few, template, normal, up_is_said=up_is_said)
    whole = few[np.isfinite(few).all(axis=(1, 2))]
    if recording.template is None and len(whole):  # a body model's own pieces are known
        findings += separate_pieces.check_pieces(whole[0], recording.faces, normal)
    if not any(each.level == "wrong" for each in findings):
        weighed = few[check.evenly(len(few), WEIGHED)]
        findings += plausibility.masses(ip.mass_properties(weighed, template).mass, weighed)
    return findings


def _not_used(recording: BodySequence, read_elsewhere: Collection[str]) -> list[str]:
    names = [name for name in recording.unused if name not in read_elsewhere]
    return [f"not used: {safe_npz.first_arrays(names, LISTED)}"] if names else []


def read(path: Path, request: Request) -> BodySequence:
    """The bodies in a file, by the ending of its name."""
    try:
        regular_file(path)
    except ValueError as error:
        raise FileError(path, str(error)) from None
    if path.stat().st_size == 0:
        raise FileError(path, "is empty; export it again")
    if path.suffix.lower() == ".npz":
        return _parameters(path, request)
    recording = read_mesh(path)
    return recording if request.units == 1.0 else replace(recording, vertices=recording.vertices[:] * request.units)


def _parameters(path: Path, request: Request, arrays: Arrays | None = None) -> BodySequence:
    return read_npz(path, request.model, unit=request.units, degrees=request.degrees, rate=request.rate, arrays=arrays)


def _lowest(recording: BodySequence, normal: np.ndarray, progress: Progress) -> float:
    """The least finite height along the normal; infinite if there is none."""
    lowest = np.inf
    with progress(f"finding the ground of {recording.path.name}", len(recording.vertices)) as step:
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


def _template(recording: BodySequence, request: Request) -> tuple[Any, list[str]]:
    """The template of a recording, and where its parts come from."""
    faces = recording.faces
    if recording.template is not None and request.parts is None:
        return recording.template, []
    frames = (frame for piece in pieces(recording.vertices, PIECE) for frame in piece)
    first = next((frame.copy() for frame in frames if np.isfinite(frame).all()), None)
    if first is None:
        raise FileError(recording.path, "no frame has finite vertices only; export it again")
    if request.parts is not None:
        face_parts, names = read_parts(Path(request.parts), faces, recording.vertex_map, recording.face_map)
        template = ip.BodyTemplate(first, faces, face_parts, names)
        return template, [f"parts: {len(names)} from {request.parts}"]
    body = match_body(faces, len(first), request.model or "anny")
    if body is not None:
        return body.template, [f"parts: the {len(body.part_names)} of the body {body.name}, whose topology it has"]
    template = ip.BodyTemplate(first, faces)
    return template, ["parts: none known, so it is analysed as one part (`parts=FILE` names them)"]
