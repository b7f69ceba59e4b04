"""What figures are drawn of: data sets that are opened one after the other, and single bodies from files."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

import ipman_rs as ip
from ipman_rs.body import BodyModel
from ipman_rs.data.frames import DataSet
from ipman_rs.evaluation.tables.job import Source
from ipman_rs.evaluation.tables.models import Models
from ipman_rs.files.errors import FileError
from ipman_rs.study.from_file import Request, add_unit_warning, collect_unit_warnings, on_ground

AS_IT_IS = Request()


def numbered(names: Sequence[str]) -> list[str]:
    """Names with a number behind those that came before."""
    return [name if name not in names[:k] else f"{name}-{names[:k].count(name) + 1}" for k, name in enumerate(names)]


def models_in(folder: Path | None) -> Models:
    """The body models anywhere below a folder. ValueError if it is none."""
    if folder is not None and not folder.is_dir():
        raise ValueError(f"{folder}: expected the folder of body models; there is none")
    return Models(folder)


@dataclass(frozen=True)
class DataSets:
    """Data sets by name and path, the same split and reader's options for all; `models`: the body models they need."""

    names: Sequence[str] = ()
    paths: Sequence[Path] = ()
    split: str | None = None
    options: Mapping[str, str | int | float] | None = None
    models: Models = Models(None)

    @contextmanager
    def open(self) -> Iterator[Iterator[tuple[str, DataSet]]]:
        """Each with its title, opened when its turn comes; what is unpacked lasts as long as the context.

        ValueError, naming the data set or its file, for what cannot be read.
        """
        with TemporaryDirectory() as folder:
            yield self._opened(Path(folder))

    def _opened(self, unpacked: Path) -> Iterator[tuple[str, DataSet]]:
        options = tuple((self.options or {}).items())
        for title, name, path in zip(numbered(self.names), self.names, self.paths, strict=True):
            try:
                data = Source(name, str(path), self.split, options).open(unpacked, self.models)
            except TypeError as error:  # an option that its reader does not have
                raise ValueError(f"{name}: {error}") from error
            yield title, data


class Body(NamedTuple):
    """One body (V, 3) m on its ground; `flags`: what is odd about it."""

    vertices: NDArray[np.floating]
    template: ip.BodyTemplate
    ground: ip.Ground
    name: str
    flags: tuple[str, ...] = ()


def named_pose(pose: str, body: BodyModel, height: float = 0.0) -> Body:
    """A pose of `ipman_rs.body.poses.NAMES`, y up, on the plane y = `height` m."""
    return Body(ip.body.posed(body, pose), body.template, ip.Ground.y_up(height), pose)


def body_of(source: str | Path, frame: int | None = None, request: Request = AS_IT_IS) -> Body:
    """A frame of a file, or a named pose of the body model that is requested, y up.

    Raises:
        FileError: as `one_body`.
        ValueError: neither a file nor a pose, options of files beside a pose, or a frame that there is not.
    """
    poses = ip.body.poses.NAMES
    if str(source) in poses and not Path(source).exists():
        for name, value in (("frame", frame), ("up", request.up), ("parts", request.parts)):
            if value is not None:
                raise ValueError(f"{name}: is for files; {source} is a named pose, one body with y up")
        return named_pose(str(source), ip.load_body(request.model or "anny"), request.ground or 0.0)
    if not Path(source).suffix and not Path(source).exists():
        raise ValueError(f"expected a file, or a pose such as {', '.join(poses)}; got {str(source)!r}")
    try:
        return one_body(Path(source), frame or 0, request)
    except IndexError as error:
        raise ValueError(f"frame: {error}") from error


def one_body(path: Path, frame: int = 0, request: Request = AS_IT_IS) -> Body:
    """One frame of a file, as `ipman analyze` reads it.

    Raises:
        FileError: the file cannot be read, or what it holds cannot be a person.
        IndexError: it has no such frame.
    """
    try:
        with collect_unit_warnings() as sizes:
            recording, template, ground, _ = on_ground(path, request)
    except (ValueError, TypeError) as error:
        raise FileError(path, str(error)) from error
    count = len(recording.vertices)
    if frame >= count:
        raise IndexError(f"{path} has {count} frames, from 0; there is no frame {frame}")
    name = path.stem if count == 1 else f"{path.stem}, frame {frame}"
    return Body(recording.vertices[frame], template, ground, name, add_unit_warning(recording.flags, sizes))
