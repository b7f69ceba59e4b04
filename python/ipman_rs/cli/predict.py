"""`ipman predict`: bodies for images from a trained regressor."""

from __future__ import annotations

import sys
from collections.abc import Callable
from contextlib import AbstractContextManager, ExitStack, nullcontext
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from ..files.errors import FileError
from .options import of_unknown_camera

if TYPE_CHECKING:
    from ..fitting.photo import Box
    from ..training.predict import TrainedModel
    from ..view import Study


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
    **seen: Any,
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
    if seen["box"] and seen["whole"]:
        raise click.UsageError("expected --box or --whole, not both")
    try:
        from ..training.predict import TrainedModel

        trained = TrainedModel.load(checkpoint)
    except ImportError as error:
        console.error(f"{error.name} is needed: pip install 'ipman_rs[train]'")
        sys.exit(1)
    except ValueError as error:
        console.error(str(error))
        sys.exit(1)
    if data is not None and path is not None:
        _write_predictions(trained, data, path, split, image_folder, regressor, output)
        return
    paths = [found for path in images for found in (_inside(path, IMAGES) if path.is_dir() else [path])]
    studies: list[Study] = []
    failures: list[tuple[str, str]] = []
    with ExitStack() as opened:
        try:
            box = opened.enter_context(_boxes(seen["box"], seen["whole"]))
        except ImportError as error:
            console.error(f"{error}; or give --box or --whole")
            sys.exit(1)
        step = opened.enter_context(console.progress("looking", len(paths)))
        for number, path in enumerate(paths):
            try:
                studies.append(_predicted(trained, path, box, output, number < pictures, seen))
            except FileError as error:
                failures.append((str(path), error.what))
                console.error(str(error))
            step.one()
    if studies:
        from .report import write

        page = write(studies, output, failures, own_folders=True)
        console.print_table(studies)
        for study in studies:
            for flag in study.flags:
                console.warn(f"{study.source}: {flag}")
        console.say(f"report: {page}")
    sys.exit(1 if failures or not paths else 0)


def _write_predictions(
    trained: TrainedModel, name: str, path: Path, split: str | None, images: Path, regressor: Path | None, output: Path
) -> None:
    import ipman_rs.data

    from ..body import joint_regressors
    from ..files import write_whole
    from ..fitting.jobs.outputs import npz
    from . import console

    try:
        data = ipman_rs.data.open(name, path, **({} if split is None else {"split": split}))
        told = regressor or trained.settings.model.regressor
        hips = joint_regressors.read(told) if told else None
        with console.progress("looking", len(data)) as step:
            found = trained.of_data_set(data, images, step.to, hips)
    except (OSError, TypeError, ValueError) as error:
        console.error(f"{name}: {error}")
        sys.exit(1)
    output.mkdir(parents=True, exist_ok=True)
    write_whole(output / "predictions.npz", npz(found))
    console.say(f"{output / 'predictions.npz'}: {len(found['names'])} of {len(data)} people")


def _inside(folder: Path, endings: tuple[str, ...]) -> list[Path]:
    return sorted(path for path in folder.iterdir() if path.suffix.lower() in endings)


def _boxes(given: Box | None, whole: bool) -> AbstractContextManager[Callable[[Path, Any], Box]]:
    """Where the person is, of an image's path and pixels."""
    from ..fitting import photo

    if whole:
        return nullcontext(lambda path, pixels: (0.0, 0.0, float(pixels.shape[1]), float(pixels.shape[0])))
    return photo.boxes() if given is None else nullcontext(lambda path, pixels: given)


def _predicted(
    trained: TrainedModel,
    path: Path,
    box_of: Callable[[Path, Any], Box],
    output: Path,
    pictured: bool,
    seen: dict[str, Any],
) -> Study:
    """The analysed body of one image, whose files are written. FileError if it cannot be read or has an empty box."""
    from dataclasses import replace

    import numpy as np
    from PIL import Image

    import ipman_rs as ip

    from .. import view
    from ..body import pose_arrays
    from ..fitting import photo
    from ..fitting.jobs import outputs
    from ..io import write_mesh
    from ..study import camera_of

    try:
        pixels = photo.read(path)
        height, width = pixels.shape[:2]
        box = box_of(path, pixels)
        found = trained.predict(Image.fromarray(pixels), box, seen["focal"], seen["pitch"])
    except ValueError as error:
        raise FileError(path, str(error)) from error
    body = trained.posing.body.body
    vertices = np.asarray(body(found.pose, found.betas, found.transl).vertices)
    camera = {
        "camera_rotation": found.rotation, "camera_translation": np.zeros(3),
        "focal": np.full(2, found.focal), "center": found.center,
    }  # fmt: skip
    arrays: dict[str, Any] = {
        **pose_arrays.split(found.pose[None], body), "betas": found.betas[None], "transl": found.transl[None],
        "image_size": np.array([[width, height]], float), "model": np.array(body.name),
        **{name: value[None] for name, value in camera.items()},
    }  # fmt: skip
    files = {f"{path.stem}.npz": arrays, f"{path.stem}.glb": write_mesh.glb(vertices, body.faces)}
    outputs.write_files(output / path.stem, files, {"name": path.stem, "source": str(path)})
    ground = ip.Ground.under(vertices)
    note = "predicted in one look; the floor lies under the lowest vertex"
    flags = _flags(path, vertices, body.template, ground.normal)
    study = view.study(path.stem, vertices, body.template, ground, source=str(path), notes=[note], flags=flags)
    fitted = view.Fitted(
        camera=camera_of(*camera.values()), size=(width, height), seen=np.zeros((0, 3)), projected=np.zeros((0, 2)),
        photo=pixels if pictured else None, pictured=pictured, record={"box": [float(side) for side in box]},
    )  # fmt: skip
    return replace(study, fitted=fitted)


def _flags(path: Path, vertices: Any, template: Any, normal: Any) -> tuple[str, ...]:
    """What is odd about a predicted body, in words; options mend files, not predictions."""
    from dataclasses import replace

    import numpy as np

    import ipman_rs as ip

    from ..data import judge

    one = np.asarray(vertices)[None]
    found = [*judge.bodies(one, template, normal), *judge.masses(ip.mass_properties(one, template).mass, one)]
    return judge.admit(path, [replace(each, option="", advice="") for each in found], force=True)
