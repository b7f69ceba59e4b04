"""`ipman fit --data`: the people of a data set, fitted frame by frame."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import click

from . import console

NOT_OF_DATA = ("camera", "focal", "ground", "image", "person", "image_size", "contact", "pose_frame", "pose_up")


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

    given = [f"--{name.replace('_', '-')}" for name in NOT_OF_DATA if options.get(name) is not None]
    if given:
        raise click.UsageError(f"--data brings its own cameras, ground and people: leave out {', '.join(given)}")
    paper = PAPER.get(source["name"])
    preset = options["preset"] or ("fast" if paper is None else paper.preset)
    try:
        chosen = config.load(preset)
    except ValueError as error:
        raise click.UsageError(str(error)) from error
    if options["iterations"] is not None:
        chosen = config.capped(chosen, options["iterations"])
    of_person = {name: options[name] for name in ("height", "mass", "pose")}
    data = source_of(source["name"], source["path"], source["split"], dict(source["options"]))
    job = DataFit(data, chosen, output, models, options["model"], keypoints, images, every, **of_person)
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
    _say(record, output / PREDICTIONS, source)
    return 1 if record["left_out"] else 0


def _say(record: dict[str, Any], predictions: Path, source: dict[str, Any]) -> None:
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
    from ..fitting.data_fits import PAPER

    paper = PAPER.get(source["name"])
    which = f"--data {source['name']}" if paper is None else f"--table {paper.table}"
    partial = " --partial" if record["left_out"] or record["fitted"] < record["frames"] else ""
    console.say(
        f"next: ipman evaluate {predictions} {which} --path {source['path']} -o {predictions.parent}/table{partial}"
    )
