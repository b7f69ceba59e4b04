"""`ipman fit --data`: the people of a data set, fitted frame by frame."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import click
from click.core import ParameterSource

from . import console

NOT_OF_DATA = (
    "camera", "focal", "pitch", "ground", "photo", "person", "image_size", "obj", "pictures", "sequence", "fps",
    "resume",
)  # fmt: skip


def fit_data(
    source: dict[str, Any],
    output: Path,
    models: Path | None,
    keypoints: Path | None,
    images: Path,
    every: int,
    options: dict[str, Any],
) -> int:
    """Fits a data set and says what became of it; the exit code."""
    from ..fitting import config
    from ..fitting.data_fits import PAPER, PREDICTIONS, DataFit, source_of
    from ..fitting.presented import PoseSource

    said = click.get_current_context().get_parameter_source
    given = [name for name in NOT_OF_DATA if said(name) is ParameterSource.COMMANDLINE]
    if given:
        words = ", ".join("--camera-pitch" if name == "pitch" else f"--{name.replace('_', '-')}" for name in given)
        raise click.UsageError(
            f"--data has its own cameras, ground and people, and goes on by itself: leave out {words}"
        )
    paper = PAPER.get(source["name"])
    preset = options["preset"] or ("fast" if paper is None else paper.preset)
    try:
        chosen = config.load(preset)
        pose = PoseSource.of(*(options[name] for name in ("pose", "pose_frame", "pose_up", "contact")))
    except ValueError as error:
        raise click.UsageError(str(error)) from error
    if options["iterations"] is not None:
        chosen = config.limit_iterations(chosen, options["iterations"])
    size = {name: options[name] for name in ("height", "mass")}
    data = source_of(source["name"], source["path"], source["split"], dict(source["options"]))
    job = DataFit(data, chosen, output, models, options["model"], keypoints, images, every, pose, **size)
    try:
        job.begin()
        with console.progress(f"fitting {source['name']}", len(job.rows)) as step:
            record = job.run(step.to)
    except (ValueError, TypeError, ImportError) as error:
        console.error(str(error))
        return 1
    except OSError as error:
        console.error(f"{error.filename or output}: {error.strerror or error}; what is done is kept")
        return 1
    _say(record, output / PREDICTIONS, source, models)
    return 1 if record["left_out"] else 0


def _say(record: dict[str, Any], predictions: Path, source: dict[str, Any], models: Path | None) -> None:
    count = record["fitted"]
    console.print_rows(
        ["", "frames", "fitted", "converged", "error px", "error %"],
        [
            [
                record["preset"], f"{record['frames']:,}", f"{count:,}", f"{100 * record['converged'] / count:.0f} %",
                f"{record['median_reprojection_px']:.1f}", f"{record['median_reprojection_percent']:.1f}",
            ]
        ],
    )  # fmt: skip
    if record["with_presented_contact"] is not None:
        said = f"presented: {record['presented']}; something touches in {record['with_presented_contact']:,} of them"
        console.say(f"{said}, the others have no presented_contact")
    for each in record["left_out"][:10]:
        console.warn(f"{each['frame']}: left out: {each['why']}")
    if len(record["left_out"]) > 10:
        console.warn(f"and {len(record['left_out']) - 10:,} frames more, see fits.json")
    console.say(f"predictions: {predictions.resolve()}")
    console.say(f"next: {_evaluation(record, predictions, source, models)}")


def _evaluation(record: dict[str, Any], predictions: Path, source: dict[str, Any], models: Path | None) -> str:
    """The command that measures the predictions."""
    from ..evaluation.tables.paper import TABLES
    from ..fitting.data_fits import PAPER

    paper = PAPER.get(source["name"])
    table = paper.table if paper is not None else source["name"]
    words = ["ipman evaluate", str(predictions), f"--table {table}" if table in TABLES else f"--data {source['name']}"]
    words += [f"--path {source['path']}"]
    words += [] if source["split"] is None else [f"--split {source['split']}"]
    words += [f"--option {name}={value}" for name, value in source["options"]]
    words += [] if models is None else [f"--models {models}"]
    words += ["--partial"] if record["left_out"] or record["every"] > 1 else []
    return " ".join([*words, f"-o {predictions.parent / 'table'}"])
