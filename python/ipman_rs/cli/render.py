"""`ipman data render`: images of the embedded body. Heavy imports wait until the command runs."""

from __future__ import annotations

from pathlib import Path

import click

from .errors import one_line_errors, writing
from .options import resumes, several_processes


@click.command()
@click.option("-o", "--output", required=True, type=click.Path(path_type=Path), help="Folder, new or begun.")
@click.option("-n", "--images", type=click.IntRange(1), default=4000, show_default=True, help="Images to train on.")
@click.option("--val", type=click.IntRange(0), help="Images to validate on. Default: a tenth of -n.")
@click.option("--test", type=click.IntRange(0), help="Images to test on. Default: a tenth of -n.")
@click.option("--seed", type=click.IntRange(0), default=0, show_default=True, help="Other seeds draw other people.")
@click.option("--size", type=click.IntRange(32, 2048), default=224, show_default=True, help="Pixels of a side.")
@click.option(
    "--body", type=click.Choice(["anny-lite", "anny"]), default="anny-lite", show_default=True,
    help="The body with 1,229 vertices, or with 12,272.",
)  # fmt: skip
@click.option(
    "--moving", type=click.FloatRange(0, 1), default=0.15, show_default=True,
    help="Share of upright people who are tipped over or in the air; labelled as not static.",
)  # fmt: skip
@click.option("--shard-size", type=click.IntRange(1), default=500, show_default=True, help="Images a shard.")
@several_processes
@resumes
def render(
    output: Path,
    images: int,
    val: int | None,
    test: int | None,
    seed: int,
    size: int,
    body: str,
    moving: float,
    shard_size: int,
    workers: int,
) -> None:
    """Images of the built-in body on a known floor, with keypoints, parameters, cameras and ground.

    People of varied shape, dressed in varied colours, in the named poses perturbed and laid to rest on the floor, in
    rooms, outdoors and in studios; drawn without GPU or display, about ten a second on each core. The folder gets
    shards in WebDataset's layout and index.json; docs/use/rendered.md says what a sample consists of.

    \b
    ipman data render -o out/images -n 4000 --seed 1
    ipman data check rendered out/images

    The same options give the same bytes, whatever the number of processes. Interrupted, the same command goes on with
    the first shard that is not whole. Needs pip install 'ipman_rs[render]'.
    """
    from . import console

    counts = {
        "train": images,
        "val": images // 10 if val is None else val,
        "test": images // 10 if test is None else test,
    }
    with one_line_errors(output), writing(output):
        from ..synthetic.images.samples import RenderSettings
        from ..synthetic.images.writer import write

        with console.progress("rendering", sum(counts.values())) as step:
            drawn = write(output, RenderSettings(seed, size, body, moving), counts, shard_size, workers, step.to)
    listed = ", ".join(f"{count} {split}" for split, count in counts.items())
    console.say(f"{output}: {listed}; {drawn} drawn now")
