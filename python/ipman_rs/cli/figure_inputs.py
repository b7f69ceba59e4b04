"""What `ipman figure` draws: data sets, body models, single bodies; and the one line that says what is wrong there."""

from __future__ import annotations

import sys
import warnings
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from ..files.errors import FileError

if TYPE_CHECKING:
    from ..data import DataSet
    from ..evaluation.tables.models import Models


def one_body(body: str, frame: int | None, request: dict[str, Any]) -> tuple[Any, Any, Any, str]:
    """Vertices, template, ground and name; `request`: the fields of `study.from_file.Request`."""
    import ipman_rs as ip

    from ..study.from_file import Request, add_unit_warning, collect_unit_warnings, on_ground
    from . import console

    if body in ip.body.poses.NAMES and not Path(body).exists():
        for option, value in (("--frame", frame), ("--up", request["up"]), ("--parts", request["parts"])):
            if value is not None:
                raise click.UsageError(f"{option}: is for files; {body} is a named pose, one body with y up")
        posed = ip.load_body(request["model"] or "anny")
        return ip.body.posed(posed, body), posed.template, ip.Ground.y_up(request["ground"] or 0.0), body
    if not Path(body).suffix and not Path(body).exists():
        raise click.UsageError(
            f"BODY: expected a file, or a pose such as {', '.join(ip.body.poses.NAMES)}; got {body!r}"
        )
    path = Path(body)
    try:
        with collect_unit_warnings() as sizes:
            recording, template, floor, _ = on_ground(path, Request(**request))
        console.warn_of(path, add_unit_warning(recording.flags, sizes))
    except (ValueError, TypeError) as error:
        raise FileError(path, str(error)) from error
    count, frame = len(recording.vertices), frame or 0
    if frame >= count:
        raise click.UsageError(f"--frame: {body} has {count} frames, from 0; there is no frame {frame}")
    return recording.vertices[frame], template, floor, path.stem if count == 1 else f"{path.stem}, frame {frame}"


def told_apart(names: list[str]) -> list[str]:
    """Names with a number behind those that came before."""
    return [name if name not in names[:k] else f"{name}-{names[:k].count(name) + 1}" for k, name in enumerate(names)]


def opened_data_sets(
    names: tuple[str, ...],
    paths: tuple[Path, ...],
    split: str | None,
    options: tuple[tuple[str, Any], ...],
    models: Models,
) -> Iterator[tuple[str, DataSet]]:
    """Each data set with its name, opened when its turn comes."""
    import tempfile

    from ..evaluation.tables.job import Source

    unpacked = click.get_current_context().with_resource(tempfile.TemporaryDirectory())  # until the command ends

    if len(names) != len(paths):
        raise click.UsageError(f"expected a --path for each --data, got {len(names)} and {len(paths)}")
    for title, name, path in zip(told_apart(list(names)), names, paths, strict=True):
        try:
            data = Source(name, str(path), split, options).open(Path(unpacked), models)
        except TypeError as error:  # an option that its reader does not have
            raise ValueError(f"{name}: {error}") from error
        yield title, data


def models_in(folder: Path | None) -> Models:
    from ..evaluation.tables.models import Models

    if folder is not None and not folder.is_dir():
        raise ValueError(f"{folder}: expected the folder of body models; there is none")
    return Models(folder)


@contextmanager
def one_line_errors(output: Path) -> Iterator[None]:
    """Ends the command with one line and exit code 1 where something could not be read or written; a warning about
    units is one line, too, and one about an image is one for each."""
    import ipman_rs as ip

    from ..paper_figures.estimated_people import ImageWarning
    from . import console

    try:
        with warnings.catch_warnings(record=True) as caught:
            warnings.simplefilter("ignore")
            for kind in (ip.UnitsWarning, ImageWarning):
                warnings.simplefilter("always", kind)
            yield
        units = [str(each.message) for each in caught if issubclass(each.category, ip.UnitsWarning)]
        images = [str(each.message) for each in caught if issubclass(each.category, ImageWarning)]
        for said in (*units[:1], *dict.fromkeys(images)):
            console.warn(said)
    except (FileError, ValueError, ImportError) as error:
        console.error(str(error))
        sys.exit(1)
    except MemoryError:
        console.error("there is not enough memory; take fewer frames")
        sys.exit(1)
    except OSError as error:
        console.error(f"{error.filename or output}: {error.strerror or error}")
        sys.exit(1)
