"""`ipman evaluate`: predictions against a data set. Heavy imports wait until the command runs."""

from __future__ import annotations

import sys
import time
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from .options import PRESETS, Setting, degrees, force, units

if TYPE_CHECKING:
    from ..evaluation.tables.job import Job, Shard
    from ..evaluation.tables.paper import Table

# Kept equal to `ipman_rs.evaluation.tables.paper.TABLES` by a test.
TABLES = ("rich", "h36m", "moyo", "biomech", "com", "3dpw", "push-pull", "rich-o-star")


class ShardOf(click.ParamType):
    name = "i/n"

    def convert(self, value, param, ctx):
        """Number and count, from 1."""
        if isinstance(value, tuple):
            return value
        words = value.split("/")
        if len(words) != 2 or not all(word.isdecimal() for word in words) or not 1 <= int(words[0]) <= int(words[1]):
            self.fail(f"{value!r} is no shard such as 2/7, the second of seven", param, ctx)
        return int(words[0]), int(words[1])


@click.command()
@click.argument("predictions", nargs=-1, required=True, metavar="PRED...", type=click.Path(path_type=Path))
@click.option("-o", "--output", required=True, type=click.Path(file_okay=False, path_type=Path), help="Output folder.")
@click.option("--data", metavar="NAME", help="Data set: one of `ipman data list`, or own (see above).")
@click.option("--path", type=click.Path(path_type=Path), metavar="PATH", help="Folder or file of the data set.")
@click.option("--split", metavar="NAME", help="Part of the data set, such as test.")
@click.option(
    "--option", "options", type=Setting(), multiple=True, help="Of the data set's reader, such as frame=camera."
)
@click.option("--table", type=click.Choice(TABLES), help="A table of the paper: its data set, split and figures.")
@click.option(
    "--models", type=click.Path(path_type=Path), metavar="FOLDER",
    help="Body models: SMPL_NEUTRAL.pkl, SMPLX_MALE.npz … anywhere below it.",
)  # fmt: skip
@click.option(
    "--regressor", "regressors", multiple=True, type=click.Path(path_type=Path), metavar="FILE",
    help="J_regressor_h36m.npy: compare the 14 joints of the literature instead of the body model's. "
    "J_regressor_extra.npy: SPIN's joints that SMPL does not have. May be given twice.",
)  # fmt: skip
@click.option(
    "--preset", type=click.Choice(PRESETS), default="paper-r", show_default=True, help="Constants of the pressure."
)
@click.option("--partial", is_flag=True, help="Leave out frames without prediction (otherwise an error).")
@units
@degrees
@force
@click.option("--shard", type=ShardOf(), help="Do this part only, such as 2/7; the last one writes the report.")
@click.option("--ray", is_flag=True, help="Do the shards on Ray (RAY_ADDRESS: a cluster; else this machine).")
def evaluate(
    predictions: tuple[Path, ...], output: Path, shard: tuple[int, int] | None, ray: bool, **given: Any
) -> None:
    """Measure predictions against a data set: errors, balance, contact and pressure, with intervals.

    PRED is an .npz or .parquet file: names (F,) of the frames as the data set calls them, in any order, and pose
    (F, J, 3) with betas, transl and body (smpl, smplh, smplx, anny, anny-lite), or vertices (F, V, 3), or joints
    (F, K, 3) with joint_names. Metres, in the axes of the data set, or with a ground (4,) of its own: normal and
    height. --units, --degrees and --force are about these files. With several files each is compared with the first,
    frame by frame. The data set own is a file in the same form: your truth. The word truth instead of a file: the data
    set's own bodies, held against what was measured.

    OUTPUT gets evaluation.md, .json, .csv, .svg and .png, sequences.csv, frames.parquet with all figures of each frame
    (needs the extra evaluate), and the pieces it is made of: interrupted, the same command goes on where it was.
    Shards may run one after the other, side by side, or on other machines if their OUTPUT/methods are copied together;
    when all pieces are there, the report is written, the same to the bit however they were made.

    \b
    ipman evaluate hmr.npz --table rich --path RICH/ --models models/ -o out
    ipman evaluate truth --table biomech --path MOYO/ --models models/ -o out
    ipman evaluate ours.npz theirs.npz --data moyo --path MOYO/ --models models/ -o out
    ipman evaluate estimated.npz --data own --path true.npz -o out
    ipman evaluate big.parquet --data own --path true.npz -o out --shard 2/7

    Exit code: 0 when all is well (also of a shard), 1 when something could not be read or measured, 2 for wrong usage.
    """
    from . import console

    if ray and shard:
        raise click.UsageError("--ray does all shards: leave out --shard")
    try:
        table, jobs = _jobs(predictions, output, given)
        _evaluate(jobs, table, output, shard, ray)
    except (ValueError, ImportError) as error:
        console.error(str(error))
        sys.exit(1)
    except MemoryError:
        console.error("there is not enough memory; is something else running? What is done is kept")
        sys.exit(1)
    except OSError as error:
        console.error(f"{error.filename or output}: {error.strerror or error}; what is done is kept")
        sys.exit(1)


def _jobs(predictions: tuple[Path, ...], output: Path, given: dict[str, Any]) -> tuple[Table | None, list[Job]]:
    from ..evaluation.tables.job import Job, Source, method_names
    from ..evaluation.tables.paper import TABLES as PAPER

    table = None if given["table"] is None else PAPER[given["table"]]
    name = given["data"] or (table.data if table else None)
    if name is None:
        raise click.UsageError("Missing option '--data', the data set, or '--table', one of the paper's.")
    if given["path"] is None:
        raise click.UsageError(f"Missing option '--path', where {name} is.")
    split = given["split"] or (table.split if table is not None and name == table.data else None)
    defaults = table.options if table is not None and name == table.data else {}
    source = Source(name, str(given["path"]), split, tuple({**defaults, **dict(given["options"])}.items()))
    shared = {
        "models": None if given["models"] is None else str(given["models"]),
        "regressors": tuple(str(path) for path in given["regressors"]),
        "preset": given["preset"],
        "partial": given["partial"],
        "unit": given["units"],
        "degrees": given["degrees"],
        "force": given["force"],
        "folder": str(output),
    }
    names = method_names(predictions)
    return table, [Job(name, str(path), source, **shared) for name, path in zip(names, predictions, strict=True)]


def _evaluate(jobs: list[Job], table: Table | None, output: Path, shard: tuple[int, int] | None, ray: bool) -> None:
    from ..evaluation.tables.job import Shard
    from . import console

    for job in jobs:
        job.begin()
        for number in job.damaged():
            console.warn(f"{job.file(number)}: is not whole, or of another evaluation; it is measured again")
        for flag in job.flags:
            console.warn(f"{job.predictions}: {flag}")
    _measure(jobs, Shard(*shard) if shard else Shard(), ray)
    missing = sum(len(job.missing()) for job in jobs)
    if missing:
        every = sum(job.pieces for job in jobs)
        console.say(f"{every - missing} of {every} pieces are there; the other shards have the rest")
        return
    _report(jobs, table, output)


def _measure(jobs: list[Job], shard: Shard, ray: bool) -> None:
    from . import console

    todo = sum(job.frames(number) for job in jobs for number in shard.of(job.pieces) if not job.done(number))
    begun = time.perf_counter()
    with console.progress("measuring", todo) as step:
        count = _counter(step)
        if ray:
            from ..evaluation.tables import on_ray

            on_ray.run(jobs, count)
        else:
            for job in jobs:
                job.run(shard, count)
    seconds = time.perf_counter() - begun
    if todo:
        console.say(f"{todo:,} frames in {seconds:.1f} s: {todo / seconds:,.0f} a second")


def _report(jobs: list[Job], table: Table | None, output: Path) -> None:
    from ..evaluation.tables import report
    from ..evaluation.tables.summary import difference, summarise
    from . import console

    frames = sum(len(job.data) for job in jobs)
    with console.progress("adding up", 2 * frames - len(jobs[0].data)) as step:
        count = _counter(step)
        found = [summarise(job, count) for job in jobs]
        differences = [difference(job, jobs[0], count) for job in jobs[1:]]
    source = jobs[0].source
    title = table.title if table else f"{' and '.join(job.name for job in jobs)} on {source.name}"
    parts = [source.name, *([source.split] if source.split else []), *(f"{k}={v}" for k, v in source.options)]
    where = f"Data: {', '.join(parts)}, {len(jobs[0].data):,} frames ({source.path})."
    definitions = {job.name: job.definition for job in jobs}
    flags = {job.name: job.flags for job in jobs}
    made = report.Report(title, where, found, differences, table, definitions, flags)
    with console.progress("writing", frames) as step:
        written = report.write(made, output, jobs, _counter(step))
    console.print_rows(*report.rows(made))
    if not any(path.suffix == ".parquet" for path in written):
        console.say("frames.parquet is left out: it needs pyarrow (pip install 'ipman_rs[evaluate]')")
    console.say(f"report: {written[0].resolve()}")


def _counter(step: Any) -> Any:
    """`count(n)`: n more are done."""
    done = 0

    def count(more: int) -> None:
        nonlocal done
        done += more
        step.to(done)

    return count
