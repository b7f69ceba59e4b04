"""`ipman train`: IPMAN-R's regressor on data sets that a YAML file names."""

from __future__ import annotations

from pathlib import Path

import click

from .errors import extra, one_line_errors
from .options import resumes


@click.command()
@click.argument("config", type=click.Path(dir_okay=False, path_type=Path))
@click.argument("changes", nargs=-1, metavar="[NAME=VALUE]...")
@click.option("-o", "--output", required=True, type=click.Path(file_okay=False, path_type=Path), help="Folder.")
@resumes
def train(config: Path, changes: tuple[str, ...], output: Path) -> None:
    """Train a regressor of bodies with the intuitive-physics losses.

    CONFIG is a YAML file (docs/use/training.md lists its entries), or the name of one of the paper's runs: ipman-r,
    hmr-star, ipman-r-human36m. NAME=VALUE takes precedence over it. Interrupted, the same command goes on where it was,
    with the same losses as if it had not been. Needs the extra `train`.

    \b
    ipman train hmr.yaml -o out/hmr
    ipman train hmr.yaml -o out/ipman physics.preset=paper-r steps=20000
    ipman train ipman-r -o out/ipman-r accelerator=gpu    # the paper's, with its data sets in data/
    torchrun --nproc-per-node 4 $(which ipman) train hmr.yaml -o out/hmr devices=4
    """
    if not config.exists():
        from ..training import recipes

        try:
            config = recipes.path_of(str(config))
        except ValueError as error:
            raise click.UsageError(str(error)) from None
    with one_line_errors(output):
        with extra("train"):
            from ..training.trainer.config import load
            from ..training.trainer.run import train as run
        last = run(load(config, changes), output)
    click.echo(f"checkpoint: {last}")
