"""`ipman fit`: bodies for photos and keypoint files."""

from __future__ import annotations

import sys
import warnings
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from ..files.errors import FileError
from .options import FLOOR, METRES, SIZE, UNIT, UP, Setting, force, needs, of_unknown_camera, rate, subject

if TYPE_CHECKING:
    from ..fitting.jobs.items import Item
    from ..fitting.jobs.run import Settings
    from ..view import Study


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
@click.option("--image", type=click.Path(path_type=Path), metavar="PHOTO", help="Photo to draw under a keypoint file.")
@click.option("--image-size", type=SIZE, metavar="WxH", help="Pixels of the image, where a keypoint file does not say.")
@click.option(
    "--person", type=int, metavar="N",
    help="Which person of an image, from 0, or which track of a file that follows people. Default: the most visible.",
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
@click.option(
    "--option", "settings", type=Setting(), multiple=True, help="With --data: of its reader, such as camera=2."
)
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
def fit(
    inputs: tuple[Path, ...],
    output: Path,
    image: Path | None,
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
    warnings.filterwarnings("ignore", message="`torch.jit.script`", category=FutureWarning)  # in an import of roma's
    from ..fitting.jobs.items import Reading
    from . import console

    if data is not None:
        from .fit_data import fit_data

        where = {"name": data, "path": str(path), "split": split, "options": settings}
        sys.exit(fit_data(where, output, models, keypoints, image_folder, every, options))
    options["preset"], options["model"] = options["preset"] or "fast", options["model"] or "anny-lite"
    reading = Reading(options.pop("person"), options.pop("image_size"), image, sequence, options["force"])
    items, tracks, failures = _items(inputs, reading)
    said = next((name for name in ("up", "units", "rate", "markers") if options[name] is not None), None)
    if said and not tracks and not failures:
        raise click.UsageError(f"--{said} belongs to marker files (.trc, .c3d), of which there are none")
    chosen = _settings(options)
    if fps <= 0:
        raise click.UsageError(f"--fps: expected more than 0, got {fps}")
    studies, failed = _recordings(tracks, items if sequence else [], chosen, (every, fps), output, resume)
    failures += failed
    items = [] if sequence else items
    records: dict[str, dict[str, Any]] = {}
    if items:
        records = _run(items, chosen, output, resume)
        failures += [(item.source, item.failure) for item in items if item.failure is not None]
        studies += _studies(items, records, chosen, output, pictures)
    for source, what in failures:
        console.error(f"{source}: {what}")
    if studies:
        from .report import write

        page = write(studies, output, failures, own_folders=True)
        fits, recorded = [s for s in studies if s.fitted is not None], [s for s in studies if s.fitted is None]
        if fits:
            console.print_fits(fits)
        if recorded:
            console.print_table(recorded)
        console.say(f"report: {page}")
    sys.exit(1 if failures else 0)


def _list_places(context: click.Context, _: click.Parameter, wanted: bool) -> None:
    if not wanted or context.resilient_parsing:
        return
    needs("torch", "roma", "yaml")
    import ipman_rs as ip

    from ..data.markers import places

    click.echo("\n".join(places(ip.load_body("anny-lite"))))
    context.exit()


def _items(inputs: tuple[Path, ...], reading: Any) -> tuple[list[Item], list[Path], list[tuple[str, str]]]:
    """The people in the inputs, under names of their own, the marker files, and the files that have nobody."""
    from ..fitting.jobs import items
    from ..view.report import safe_names

    found: list[Item] = []
    failures: list[tuple[str, str]] = []
    paths: list[Path] = []
    for path in inputs:
        try:
            paths += items.expand([path])
        except FileError as error:
            failures.append((str(path), error.what))
    if reading.photo is not None and len(paths) > 1:
        raise click.UsageError(f"--image belongs to one keypoint file, got {len(paths)} inputs")
    tracks = [path for path in paths if path.suffix.lower() in items.MARKERS]
    for path in paths:
        if path in tracks:
            continue
        try:
            found += items.items(path, reading)
        except FileError as error:
            failures.append((str(path), error.what))
        except (OSError, ValueError) as error:
            failures.append((str(path), str(error)))
    for item, name in zip(found, safe_names([item.name for item in found]), strict=True):
        item.name = name
    return found, tracks, failures


def _recordings(
    tracks: list[Path], frames: list[Item], settings: Settings, pace: tuple[int, float], output: Path, resume: bool
) -> tuple[list[Study], list[tuple[str, str]]]:
    """The fitted recordings, measured, and those that failed."""
    from ..fitting.jobs import recordings
    from . import console

    studies: list[Study] = []
    failures: list[tuple[str, str]] = []
    for recording in recordings.recordings(tracks, frames):
        try:
            found = recordings.fitted(recording, settings, recordings.Pace(*pace), output, resume, console.progress)
            console.warn_of(recording.source, found.flags)
            studies.append(found)
        except FileError as error:
            failures.append((recording.source, error.what))
        except OSError as error:
            failures.append((recording.source, str(error)))
    return studies, failures


def _settings(options: dict[str, Any]) -> Settings:
    import ipman_rs as ip

    from ..data.markers import own
    from ..fitting import camera_file, config
    from ..fitting.jobs.run import Settings

    try:
        options["camera"] = None if options["camera"] is None else camera_file.read(options["camera"])
        chosen, most = config.load(options.pop("preset")), options.pop("iterations")
        if options["markers"] is not None:
            own.read(options["markers"], ip.load_body(options["model"]))  # before anything is fitted
        return Settings(config=chosen if most is None else config.limit_iterations(chosen, most), **options)
    except ValueError as error:
        raise click.UsageError(str(error)) from error


def _run(items: list[Item], settings: Settings, output: Path, resume: bool) -> dict[str, dict[str, Any]]:
    from ..fitting.jobs.run import run
    from . import console

    try:
        return run(items, settings, output, resume, console.progress)
    except ValueError as error:
        raise click.UsageError(str(error)) from error
    except OSError as error:
        what = f"{output}: outputs cannot be written ({error.strerror or error}); choose another folder"
        raise click.ClickException(what) from error


def _studies(
    items: list[Item], records: dict[str, dict[str, Any]], settings: Settings, output: Path, pictures: int
) -> list[Study]:
    """The fitted bodies, measured."""
    import ipman_rs as ip

    from ..fitting import photo
    from ..fitting.jobs.outputs import study_of
    from . import console

    body = ip.load_body(settings.model)
    fitted = [item for item in items if item.name in records]
    studies = []
    with console.progress("measuring", len(fitted)) as step:
        for number, item in enumerate(fitted):
            record = records[item.name]
            studies.append(study_of(item, body, output / item.name, record, number < pictures, photo.read))
            step.one()
    return studies
