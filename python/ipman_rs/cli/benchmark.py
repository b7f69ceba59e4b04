"""`ipman benchmark`: comparisons that take minutes to hours. Heavy imports wait until a command runs."""

from __future__ import annotations

from pathlib import Path

import click


@click.group()
def benchmark() -> None:
    """Comparisons of methods on bodies whose truth is known."""


@benchmark.command()
@click.option("-o", "--output", required=True, type=click.Path(file_okay=False, path_type=Path), help="Folder.")
@click.option(
    "-n", "--bodies", type=click.IntRange(1), default=140, show_default=True, help="Balanced people, 7 families."
)
@click.option(
    "--controls", type=click.IntRange(1), default=42, show_default=True, help="Tipped people, and jumping ones."
)
@click.option(
    "--iterations", type=click.IntRange(1), default=100, show_default=True, help="Of a stage at most, for every row."
)
@click.option(
    "--split", type=click.Choice(["test", "tune"]), default="test", show_default=True,
    help="Whose people: settings are chosen on the one and reported on the other.",
)  # fmt: skip
@click.option("--only", multiple=True, metavar="BLOCK", help="A block by the start of its name; may be repeated.")
def fit(output: Path, bodies: int, controls: int, iterations: int, split: str, only: tuple[str, ...]) -> None:
    """Fitting with and without intuitive physics, on people whose bodies the fitter does not have.

    Writes fitting_benchmark.md, .json, .csv and .svg into the folder, beside the fits themselves: interrupted, the same
    command goes on where it was.
    """
    from ..fitting.benchmark import report
    from ..fitting.benchmark.run import Benchmark, blocks
    from . import console

    chosen = [block for block in blocks() if not only or block.name.startswith(only)]
    if not chosen:
        listed = "; ".join(block.name for block in blocks())
        raise click.BadParameter(f"expected the start of one of: {listed}", param_hint="'--only'")
    run = Benchmark(output, bodies, controls, iterations, split)
    for kind in dict.fromkeys(block.kind for block in chosen):
        with console.progress(f"drawing {kind} people", run.count(kind)) as step:
            run.truth(kind, step.to)
    found = []
    with console.progress("fitting", sum(len(block.rows) for block in chosen)) as step:
        for block in chosen:
            found.append((block, *run.run(block, step.one)))
    page = report.write(found, run)
    click.echo(page.read_text())
