"""`ipman predict`: bodies for images from a trained regressor."""

from __future__ import annotations

import sys
from contextlib import AbstractContextManager, ExitStack, nullcontext
from pathlib import Path
from typing import TYPE_CHECKING

import click

from .errors import extra, one_line_errors
from .options import of_unknown_camera

if TYPE_CHECKING:
    from ..training.predicted_images import Box, BoxOf


@click.command()
@click.argument("images", nargs=-1, metavar="[IMAGE|FOLDER...]", type=click.Path(path_type=Path))
@click.option("--checkpoint", required=True, type=click.Path(dir_okay=False, path_type=Path), help="Of `ipman train`.")
@click.option("-o", "--output", required=True, type=click.Path(file_okay=False, path_type=Path), help="Output folder.")
@click.option(
    "--box", type=float, nargs=4, metavar="X Y W H",
    help="Pixels around the person. Default: around the landmarks that MediaPipe finds (the extra photo).",
)  # fmt: skip
@click.option("--whole", is_flag=True, help="The person's box is the whole image.")
@of_unknown_camera
@click.option(
    "--pictures", type=click.IntRange(0), default=8, show_default=True, help="Draw the first N images (seconds each)."
)
@click.option("--data", metavar="NAME", help="Instead of images: a data set of `ipman data list` that has some.")
@click.option("--path", type=click.Path(path_type=Path), help="With --data: where it is.")
@click.option("--split", help="With --data: which part of it. Default: all.")
@click.option(
    "--image-folder", type=click.Path(file_okay=False, path_type=Path), default=Path(),
    help="With --data: where the paths of its images begin.",
)  # fmt: skip
@click.option(
    "--regressor", metavar="FILE", type=click.Path(dir_okay=False, path_type=Path),
    help="With --data: SPIN's J_regressor_extra.npy. Bodies are put where their hips are; where a data set has hips of "
    "its own and no bodies, it makes the same of ours. Default: model.regressor of the training.",
)  # fmt: skip
def predict(
    images: tuple[Path, ...],
    checkpoint: Path,
    output: Path,
    pictures: int,
    data: str | None,
    path: Path | None,
    split: str | None,
    image_folder: Path,
    regressor: Path | None,
    box: Box | None,
    whole: bool,
    focal: float | None,
    pitch: float | None,
) -> None:
    """A body for the person in each image, from a regressor that `ipman train` trained, in one look.

    The same report as of `ipman fit`, and for each image a folder with parameters (.npz, for `ipman analyze`) and mesh
    (.glb). The floor lies under the body's lowest vertex; up is the camera's, but for --camera-pitch.

    With --data the people of a data set, in its axes, in OUTPUT/predictions.npz for `ipman evaluate`:

    \b
    ipman predict photos/ --checkpoint out/hmr/best.ckpt -o out/found
    ipman predict --data rich-ipman --path RICH/ --image-folder RICH/ --checkpoint out/hmr/best.ckpt -o out/rich
    ipman evaluate out/rich/predictions.npz --table rich --path RICH/ --models models/ -o out/table

    Exit code: 0 when every image has a body, 1 when one has none (the others have), 2 for wrong usage.
    """
    from ..fitting.jobs.items import IMAGES
    from . import console

    if (data is None) == (not images) or (data is None) != (path is None):
        raise click.UsageError("expected images, or --data with --path")
    if data is None and regressor is not None:
        raise click.UsageError("--regressor: expected --data with it; without, nothing tells where hips are")
    if box and whole:
        raise click.UsageError("expected --box or --whole, not both")
    with one_line_errors(output):
        with extra("train"):
            from ..training import predicted_images as library
            from ..training.predict import TrainedModel
        trained = TrainedModel.load(checkpoint)
        if data is not None and path is not None:
            source = {"split": split, "images": image_folder, "regressor": regressor, "progress": console.progress}
            file, count, total = library.predict_data_set(trained, data, path, output, **source)
            console.say(f"{file}: {count} of {total} people")
            return
        paths = [each for path in images for each in (_inside(path, IMAGES) if path.is_dir() else [path])]
        with ExitStack() as detector:
            try:
                box_of = detector.enter_context(_boxes(box, whole))
            except ImportError as error:
                raise ImportError(f"{error}; or give --box or --whole") from error
            camera = {"focal": focal, "pitch": pitch or 0.0, "pictures": pictures, "progress": console.progress}
            studies, failures = library.predict_images(trained, paths, output, box_of, **camera)
    for failure in failures:
        console.error(str(failure))
    if studies:
        from .report import write

        page = write(studies, output, [(failure.path, failure.what) for failure in failures], own_folders=True)
        console.print_table(studies)
        for study in studies:
            console.warn_of(study.source, study.flags)
        console.say(f"report: {page}")
    sys.exit(1 if failures or not paths else 0)


def _inside(folder: Path, endings: tuple[str, ...]) -> list[Path]:
    return sorted(path for path in folder.iterdir() if path.suffix.lower() in endings)


def _boxes(box: Box | None, whole: bool) -> AbstractContextManager[BoxOf]:
    """Where the person is, of an image's path and pixels."""
    from ..fitting import photo
    from ..training.predicted_images import whole_image

    if whole:
        return nullcontext(whole_image)
    return photo.boxes() if box is None else nullcontext(lambda path, pixels: box)
