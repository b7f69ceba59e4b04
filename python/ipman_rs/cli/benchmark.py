"""`ipman benchmark`: comparisons that take minutes to hours. Heavy imports wait until a command runs."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import click

from .errors import one_line_errors
from .options import resumes, several_processes


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
@resumes
def fit(output: Path, bodies: int, controls: int, iterations: int, split: str, only: tuple[str, ...]) -> None:
    """Fitting with and without intuitive physics, on people whose bodies the fitter does not have.

    Writes fitting_benchmark.md, .json, .csv and .svg into the folder, beside the fits themselves: interrupted, the same
    command goes on where it was.
    """
    from ..ablation.fitting.benchmark import benchmark as run
    from ..ablation.fitting.run import FittingBenchmark
    from . import console

    try:
        page = run(FittingBenchmark(output, bodies, controls, iterations, split), only, console.progress)
    except ValueError as error:
        raise click.BadParameter(str(error), param_hint="'--only'") from error
    click.echo(page.read_text())


@benchmark.command()
@click.option("-o", "--output", required=True, type=click.Path(file_okay=False, path_type=Path), help="Folder.")
@click.option(
    "--images", type=click.Path(file_okay=False, exists=True, path_type=Path), metavar="FOLDER",
    help="Of `ipman data render`: train on these images. Default: on keypoints of built people.",
)  # fmt: skip
@click.option(
    "--test-images", "others", type=click.Path(file_okay=False, exists=True, path_type=Path), metavar="FOLDER",
    help="Take figures of the images in this folder instead.",
)  # fmt: skip
@click.option(
    "-n", "--bodies", type=click.IntRange(2), default=2100, show_default=True,
    help="Whose figures are taken, from keypoints.",
)  # fmt: skip
@click.option(
    "--people", type=click.IntRange(7), default=3500, show_default=True, help="That are trained on, from keypoints."
)
@click.option("--seeds", type=click.IntRange(1), default=3, show_default=True, help="Of weights and batches.")
@click.option(
    "--tilt", "tilts", multiple=True, type=click.FloatRange(0, 45), metavar="DEGREES",
    help="By which labels lean; may be repeated. Default: 0, 4, 8 and 12; with --images 0 and 8.",
)  # fmt: skip
@click.option(
    "--split", type=click.Choice(["test", "tune"]), default="test", show_default=True,
    help="Whose figures: settings are chosen on the one and reported on the other.",
)  # fmt: skip
@click.option(
    "--lean", type=click.Choice(["camera", "any"]), default="camera", show_default=True,
    help="Where to labels lean: all towards the camera, or each any way.",
)  # fmt: skip
@click.option("--part", type=click.FloatRange(0, 1), default=1.0, show_default=True, help="Of the steps, for a trial.")
@several_processes
@resumes
def train(
    output: Path,
    images: Path | None,
    others: Path | None,
    bodies: int,
    people: int,
    seeds: int,
    tilts: tuple[float, ...],
    split: str,
    lean: Any,
    part: float,
    workers: int,
) -> None:
    """Training with and without intuitive physics, on people whose truth is known.

    A regressor from keypoints (about a quarter of an hour on two cores), or HMR with a small backbone on rendered
    images (three quarters of an hour). Labels are clean, or lean against gravity as pseudo labels do. Writes
    training_benchmark.md, .json, .csv and .svg (with --images training_benchmark_images.*) into the folder, beside the
    trained regressors: interrupted, the same command goes on where it was. The same figures for any number of
    processes. Needs the extras `fit` and, with --images, `render` and `train`.

    \b
    ipman benchmark train -o out/keypoints
    ipman data render -o out/images -n 30000 --size 128
    ipman benchmark train --images out/images -o out/ablation
    """
    from . import console

    with one_line_errors(output):
        from ..ablation.training.benchmark import benchmark as run
        from ..ablation.training.from_images import ImageTask
        from ..ablation.training.from_keypoints import KeypointTask
        from ..ablation.training.run import TrainingBenchmark

        task = (
            KeypointTask(output, people, bodies, split) if images is None else ImageTask(output, images, split, others)
        )
        page = run(TrainingBenchmark(output, task, seeds, part, lean), tilts, workers, console.progress)
    click.echo(page.read_text())


@benchmark.command()
@click.argument("folder", type=click.Path(file_okay=False, exists=True, path_type=Path))
@click.option("-o", "--output", required=True, type=click.Path(file_okay=False, path_type=Path), help="Folder.")
@click.option(
    "--preset", "presets", multiple=True, default=("fast",), show_default=True, metavar="NAME|FILE",
    help="Of `ipman fit`; may be repeated.",
)  # fmt: skip
@click.option("--body", "model", default="anny-lite", show_default=True, metavar="NAME|PATH", help="Body model.")
def photos(folder: Path, output: Path, presets: tuple[str, ...], model: str) -> None:
    """Fits of real photos, judged by what a person sees in them.

    FOLDER has photos and labels.csv, a line each: file, posture (stand, walk, lunge, squat, one-leg, sit-chair,
    airborne …), trunk_lean_deg, lean_direction (forward, back, left, right, none), feet_on_floor (both, left, right,
    none), camera_pitch_deg, balanced (yes, no). A keypoint file of the same name (.json) stands for its photo.

    Writes photos_benchmark.md, .json and .csv: of the photos with such a label, how many bodies meet it; and a sheet
    with all pictures for each preset, so that anyone can judge with their own eyes. Interrupted, the same command goes
    on where it was.

    \b
    ipman benchmark photos photos/ -o out --preset fast --preset smplify-x
    """
    from . import console

    with one_line_errors(output):
        from ..ablation.photos.benchmark import benchmark as run

        page = run(folder, output, presets, model, console.progress)
    click.echo(page.read_text())
