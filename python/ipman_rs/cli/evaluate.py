"""`ipman evaluate`: predictions against a data set. Heavy imports wait until the command runs."""

from __future__ import annotations

import time
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from .errors import one_line_errors
from .options import PRESET, SETTING, SHARD, degrees, force, resumes, units

if TYPE_CHECKING:
    from ..evaluation.tables import Evaluation

# Kept equal to `ipman_rs.evaluation.tables.paper.TABLES` by a test.
TABLES = ("rich", "h36m", "moyo", "biomech", "com", "3dpw", "push-pull", "rich-o-star")


@click.command()
@click.argument("predictions", nargs=-1, required=True, metavar="PRED...", type=click.Path(path_type=Path))
@click.option("-o", "--output", required=True, type=click.Path(file_okay=False, path_type=Path), help="Output folder.")
@click.option("--data", metavar="NAME", help="Data set: one of `ipman data list`, or own (see above).")
@click.option("--path", type=click.Path(path_type=Path), metavar="PATH", help="Folder or file of the data set.")
@click.option("--split", metavar="NAME", help="Part of the data set, such as test.")
@click.option(
    "--option", "options", type=SETTING, multiple=True, help="Of the data set's reader, such as frame=camera."
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
@click.option("--preset", type=PRESET, default="paper-r", show_default=True, help="Constants of the pressure.")
@click.option("--partial", is_flag=True, help="Leave out frames without prediction (otherwise an error).")
@units
@degrees
@force
@click.option("--shard", type=SHARD, help="Do this part only, such as 2/7; the last one writes the report.")
@click.option("--ray", is_flag=True, help="Do the shards on Ray (RAY_ADDRESS: a cluster; else this machine).")
@resumes
def evaluate(
    predictions: tuple[Path, ...], output: Path, shard: tuple[int, int] | None, ray: bool, **options: Any
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
    if ray and shard:
        raise click.UsageError("--ray does all shards: leave out --shard")
    with one_line_errors(output, "what is done is kept"):
        from ..evaluation.tables import TABLES as PAPER
        from ..evaluation.tables import evaluation

        name = options["data"] or (None if options["table"] is None else PAPER[options["table"]].data)
        if name is None:
            raise click.UsageError("Missing option '--data', the data set, or '--table', one of the paper's.")
        if options["path"] is None:
            raise click.UsageError(f"Missing option '--path', where {name} is.")
        options["options"] = dict(options["options"])
        _evaluate(evaluation(predictions, output, unit=options.pop("units"), **options), shard, ray)


def _evaluate(whole: Evaluation, shard: tuple[int, int] | None, ray: bool) -> None:
    from ..evaluation.tables import Shard, report
    from . import console

    for warning in whole.begin():
        console.warn(warning)
    begun = time.perf_counter()
    done = whole.measure(Shard(*shard) if shard else Shard(), ray, console.progress)
    seconds = time.perf_counter() - begun
    if done:
        console.say(f"{done:,} frames in {seconds:.1f} s: {done / seconds:,.0f} a second")
    if whole.missing:
        here = whole.pieces - whole.missing
        console.say(f"{here} of {whole.pieces} pieces are there; the other shards have the rest")
        return
    summary = whole.report(console.progress)
    written = whole.write(summary, console.progress)
    console.print_rows(*report.rows(summary))
    if not any(path.suffix == ".parquet" for path in written):
        console.say("frames.parquet is left out: it needs pyarrow (pip install 'ipman_rs[evaluate]')")
    console.say(f"report: {written[0].resolve()}")
