"""`ipman fit`: bodies for photos and keypoint files."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from ..spellings import METRES
from .errors import writing
from .options import FLOOR, SETTING, SIZE, UNIT, UP, force, needs, of_unknown_camera, rate, resumes, subject

if TYPE_CHECKING:
    from ..fitting.jobs.run import Fits


@click.command()
@click.argument("inputs", nargs=-1, metavar="[INPUT...]", type=click.Path(path_type=Path))
@click.option("-o", "--output", required=True, type=click.Path(file_okay=False, path_type=Path), help="Output folder.")
@click.option(
    "--preset", metavar="NAME|FILE",
    help="fast, balanced, ipman-o, ipman-o-star, smplify-x, smplify-xmc, or a YAML file of your own. Default: fast; "
    "with --data the paper's of that data set.",
)  # fmt: skip
@click.option(
    "--body", "model", metavar="NAME|PATH",
    help="Body model: anny-lite, anny, or an SMPL, SMPL+H or SMPL-X file (.pkl, .npz). Default: anny-lite; with --data "
    "the data set's, out of --models.",
)  # fmt: skip
@click.option(
    "--iterations", type=click.IntRange(1), metavar="N",
    help="End each stage after N iterations at most: for a quick look. Default: as the preset says.",
)  # fmt: skip
@of_unknown_camera
@click.option(
    "--camera", type=click.Path(path_type=Path), metavar="FILE",
    help="JSON of a known camera: R, t (world to camera), focal, center, or K; before --focal and --camera-pitch.",
)  # fmt: skip
@click.option(
    "--ground", type=FLOOR, default="found", show_default=True, metavar="HEIGHT|found",
    help="Height of the floor in metres above the world's origin, which is the camera unless --camera says where that "
    "is (below it: negative); found: under the feet.",
)  # fmt: skip
@click.option("--height", type=float, metavar="M", help="Height of the person, where a preset weighs measured_shape.")
@click.option("--mass", type=float, metavar="KG", help="Mass of the person, where a preset weighs measured_shape.")
@click.option(
    "--pose", metavar="NAME|FILE",
    help="The pose that was imitated: a named one of `ipman demo`, such as tree, or an .npz or .pkl with a pose of "
    "SMPL, SMPL-X or the built-in body, and with ground and contact where it knows them.",
)  # fmt: skip
@click.option(
    "--pose-frame", type=click.IntRange(0), metavar="N", help="Which pose of that file, where it has several."
)
@click.option(
    "--pose-up", type=UP, metavar="AXIS", help="What points up in that file. Default: y; z for AMASS and MoYo."
)
@click.option(
    "--contact", type=click.Path(dir_okay=False, path_type=Path), metavar="FILE",
    help="The vertices that touch in that pose: a JSON list, or contact in an .npz or .pkl. Default: the pose file's, "
    "or those that the self-contact engine finds on the presented body.",
)  # fmt: skip
@click.option(
    "--image", "photo", type=click.Path(path_type=Path), metavar="PHOTO", help="Photo to draw under a keypoint file."
)
@click.option("--image-size", type=SIZE, metavar="WxH", help="Pixels of the image, where a keypoint file does not say.")
@click.option(
    "--person", type=int, metavar="N",
    help="Which person of an image, from 0, or which track of a file that follows people. Default: the most visible.",
)  # fmt: skip
@click.option(
    "--people", type=click.Choice(("one", "all")), default="one", show_default=True,
    help="Of a photo or a keypoint file: one person of each image, or all, who share its camera.",
)  # fmt: skip
@click.option(
    "--up", type=UP, metavar="AXIS",
    help="What points up in a marker file: x, y, z, -x, -y, -z, or a normal; the bodies are y up. Default: y for .trc, "
    "what it says for .c3d.",
)  # fmt: skip
@click.option(
    "--units", type=UNIT, metavar="UNIT",
    help=f"Unit of the lengths in a marker file: {', '.join(METRES)}, or a number of metres. Default: what it says.",
)  # fmt: skip
@rate
@click.option(
    "--markers", type=click.Path(path_type=Path), metavar="FILE",
    help="Places of markers with other names: a JSON or YAML object, or a CSV file, of names and places.",
)  # fmt: skip
@click.option(
    "--marker-places", is_flag=True, is_eager=True, expose_value=False, callback=lambda *given: _list_places(*given),
    help="List the places that --markers can name, and end.",
)  # fmt: skip
@force
@subject
@click.option("--obj", is_flag=True, help="Write meshes as .obj, too, not only as .glb.")
@click.option(
    "--pictures", type=click.IntRange(0), default=8, show_default=True, help="Draw the first N items (seconds each)."
)
@click.option("--sequence", is_flag=True, help="The inputs, in their order, are frames of one person.")
@click.option("--fps", type=float, default=30.0, show_default=True, help="Frames a second of a --sequence.")
@click.option(
    "--every", type=click.IntRange(1), default=1, show_default=True, help="Fit each n-th frame of recordings."
)
@click.option("--resume", is_flag=True, help="Skip items that were finished with the same input and options.")
@click.option(
    "--data", metavar="NAME", help="Instead of inputs: a data set of `ipman data list`, such as moyo or rich."
)
@click.option("--path", type=click.Path(path_type=Path), help="With --data: where it is.")
@click.option("--split", metavar="NAME", help="With --data: which part. Default: the paper's, or all.")
@click.option("--option", "settings", type=SETTING, multiple=True, help="With --data: of its reader, such as camera=2.")
@click.option(
    "--models", type=click.Path(file_okay=False, path_type=Path), metavar="FOLDER",
    help="With --data: body models, SMPLX_FEMALE.npz and so on, anywhere below it.",
)  # fmt: skip
@click.option(
    "--keypoints", type=click.Path(file_okay=False, exists=True, path_type=Path), metavar="FOLDER",
    help="With --data: a keypoint file for each frame, FRAME.json or FRAME_keypoints.json. Default: the data set's own "
    "keypoints, or MediaPipe's in its images.",
)  # fmt: skip
@click.option(
    "--image-folder", type=click.Path(file_okay=False, path_type=Path), default=Path(),
    help="With --data: where the paths of its images begin.",
)  # fmt: skip
@resumes
def fit(
    inputs: tuple[Path, ...],
    output: Path,
    photo: Path | None,
    pictures: int,
    resume: bool,
    sequence: bool,
    fps: float,
    every: int,
    data: str | None,
    path: Path | None,
    split: str | None,
    settings: tuple[tuple[str, str | float], ...],
    models: Path | None,
    keypoints: Path | None,
    image_folder: Path,
    **options: Any,
) -> None:
    """Fit a body to each photo, set of keypoints or marker recording, with intuitive physics.

    INPUT is a photo (.png .jpg; needs the extra photo), a keypoint file (.json of OpenPose, MMPose, AlphaPose, COCO
    or MediaPipe), a marker file (.trc, .c3d), or a folder of them. Every person is fitted for
    themselves, but for the frames of a --sequence; of several in one image one is taken. In OUTPUT every item gets a
    folder with its parameters (.npz, for `ipman analyze`), mesh (.glb), fit.json and pictures; report.html and
    report.json tell of all.

    With --data the people of a data set are fitted, a frame each, with its keypoints (or MediaPipe's), cameras and
    ground. A preset that imitates a pose is presented the recorded one, unless --pose says another. OUTPUT gets
    predictions.npz, as `ipman evaluate` reads it, and fits.json; interrupted, the same command goes on where it was.

    \b
    ipman fit photo.jpg -o out
    ipman fit keypoints/ -o out --image-size 1920x1080 --resume
    ipman fit group.jpg -o out --people all         everybody in the photo, with one camera
    ipman fit person.json --image photo.png -o out --focal 1100 --camera-pitch 8
    ipman fit yoga.json -o out --preset balanced --pose tree --height 1.7
    ipman fit yoga.json -o out --preset ipman-o --pose shown.npz --height 1.7 --mass 62
    ipman fit frames/ -o out --sequence --fps 25    one person over time, with one shape
    ipman fit squats.trc -o out --every 5           optical markers, by the preset markers
    ipman fit lab.trc -o out --up z --units mm --markers names.json           that does not say what it is
    ipman fit --data moyo --path MOYO/ --models models/ -o out/ipman-o        Table 2: then ipman evaluate --table moyo
    ipman fit --data rich --path RICH/ --models models/ -o out/ipman-o-star   and --table rich-o-star

    Exit code: 0 when every item has a body, 1 when one has none (the others have), 2 for wrong usage.
    """
    if bool(inputs) == (data is not None) or (data is None) != (path is None):
        raise click.UsageError("expected INPUT..., or --data with --path")
    needs("torch", "roma", "yaml")
    from . import console

    if data is not None:
        from .fit_data import fit_data

        where = {"name": data, "path": str(path), "split": split, "options": settings}
        sys.exit(fit_data(where, output, models, keypoints, image_folder, every, options))
    fits = _fit(inputs, output, photo, sequence, (every, fps), resume, pictures, options)
    for source, flags in fits.flags:
        console.warn_of(source, flags)
    for source, what in fits.failures:
        console.error(f"{source}: {what}")
    if fits.studies:
        from .report import write

        page = write(fits.studies, output, fits.failures, own_folders=True)
        people, recorded = (
            [study for study in fits.studies if (study.fitted is not None) == single] for single in (True, False)
        )
        if people:
            console.print_fits(people)
        if recorded:
            console.print_table(recorded)
        console.say(f"report: {page}")
    sys.exit(1 if fits.failures else 0)


def _fit(
    inputs: tuple[Path, ...],
    output: Path,
    photo: Path | None,
    sequence: bool,
    pace: tuple[int, float],
    resume: bool,
    pictures: int,
    options: dict[str, Any],
) -> Fits:
    """The fits. Ends the command for options that fit no input, and where nothing can be written."""
    from ..fitting.jobs.items import InputOptions
    from ..fitting.jobs.options import fit_options
    from ..fitting.jobs.recordings import Pace
    from ..fitting.jobs.run import fit_files
    from . import console

    options["preset"], options["model"] = options["preset"] or "fast", options["model"] or "anny-lite"
    person, size, everyone = options.pop("person"), options.pop("image_size"), options.pop("people") == "all"
    try:
        reading = InputOptions(person, size, photo, sequence, options["force"], everyone)
        chosen = fit_options(**options)
        with writing(output, "outputs"):
            return fit_files(inputs, output, chosen, reading, Pace(*pace), resume, pictures, console.progress)
        raise AssertionError  # `writing` ends the command
    except ValueError as error:
        raise click.UsageError(str(error)) from error


def _list_places(context: click.Context, _: click.Parameter, wanted: bool) -> None:
    if not wanted or context.resilient_parsing:
        return
    needs("torch", "roma", "yaml")
    import ipman_rs as ip

    from ..data.markers import places

    click.echo("\n".join(places(ip.load_body("anny-lite"))))
    context.exit()
