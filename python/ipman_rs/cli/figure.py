"""`ipman figure`: the paper's figures from any data. Heavy imports wait until a command runs."""

from __future__ import annotations

import functools
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from .errors import one_line_errors, writing
from .options import GROUND, SETTING, UP, of_files, preset

if TYPE_CHECKING:
    from ..paper_figures import PaperFigure
    from ..paper_figures.inputs import DataSets

PEOPLE = 210  # built ones: seven families in turn

_models = click.option(
    "--models", type=click.Path(path_type=Path), metavar="FOLDER",
    help="Body models: SMPL_NEUTRAL.pkl, SMPLX_MALE.npz … anywhere below it.",
)  # fmt: skip
_split = click.option("--split", metavar="NAME", help="Part of the data sets, such as test.")
_option = click.option(
    "--option", "options", type=SETTING, multiple=True, help="Of the data set's reader, such as frame_rate=30."
)
_people = click.option(
    "--people", type=click.IntRange(1), default=PEOPLE, show_default=True,
    help="Without --data: so many built people at rest (some ten a second).",
)  # fmt: skip


def _drawn(command: Callable[..., PaperFigure]) -> Callable[..., None]:
    """A command that draws a figure: its option -o, what it writes and says, and how it fails."""

    @functools.wraps(command)
    def run(output: Path, **options: Any) -> None:
        from . import console

        with one_line_errors(output, memory="take fewer frames"):
            from .. import paper_figures
            from ..paper_figures.estimated_people import distinct_warnings

            with distinct_warnings() as said:
                figure = command(**options)
            for warning in said:
                console.warn(warning)
            with writing(output, "the figure"):
                paper_figures.write(figure, output)
        if figure.summary_table is not None:
            console.print_rows(*figure.summary_table)
        for line in (*figure.summary, f"figure: {(output / f'{figure.name}.png').resolve()}"):
            console.say(line)

    folder = click.Path(file_okay=False, path_type=Path)
    return click.option("-o", "--output", required=True, type=folder, help="Output folder.")(run)


def _data_sets(command: Callable[..., PaperFigure]) -> Callable[..., PaperFigure]:
    """Options of commands that take one or several data sets, which they are given as `data`."""

    @functools.wraps(command)
    def run(names: tuple[str, ...], paths: tuple[Path, ...], **options: Any) -> PaperFigure:
        return command(data=_opened_later(names, paths, options), **options)

    data = click.option(
        "--data", "names", multiple=True, metavar="NAME",
        help="Data set of `ipman data list`, or own (as of `ipman evaluate`); may be repeated, each with its --path.",
    )  # fmt: skip
    path = click.option(
        "--path", "paths", multiple=True, type=click.Path(path_type=Path), help="Folder or file of the data set."
    )
    return data(path(_split(_option(run))))


def _opened_later(names: tuple[str, ...], paths: tuple[Path, ...], options: dict[str, Any]) -> DataSets:
    """The data sets; takes split, options and models out of the options of a command."""
    from ..paper_figures.inputs import DataSets, models_in

    if len(names) != len(paths):
        raise click.UsageError(f"expected a --path for each --data, got {len(names)} and {len(paths)}")
    models = models_in(options.pop("models", None))
    return DataSets(names, paths, options.pop("split"), dict(options.pop("options")), models)


@click.group()
def figure() -> None:
    """The paper's figures, made again from any data: a picture as PNG and SVG, and its numbers as JSON and more.

    \b
    ipman figure stability -o out          how far CoM and CoP lie apart in a data set
    ipman figure pull -o out               the gradient of L_pull over height
    ipman figure com tree -o out           the formulations of the centre of mass on one body
    ipman figure pressure --data moyo --path MOYO/ --models models/ -o out
    ipman figure poses -o out              a map of poses by t-SNE
    ipman figure compare out/baseline out/ours -o out

    Each writes NAME.png, NAME.svg and NAME.json into the folder of -o, and NAME.csv or NAME.npz where there are rows or
    arrays; the same input gives the same bytes.

    Exit code: 0 when all is well, 1 when something could not be read or written, 2 for wrong usage.
    """


@figure.command()
@_drawn
@_data_sets
@_models
@_people
@click.option("--every", type=click.IntRange(1), default=1, show_default=True, help="Take each n-th frame.")
@preset
def stability(data: DataSets, people: int, every: int, preset: str) -> PaperFigure:
    """The distribution of L_stability, CoM to CoP on the ground, over data sets; the paper says that it peaks at 0.

    Without --data of built people whose balance is known. The numbers: median, percentiles, the share below 50 mm, and
    the fullest bin (10 mm wide, 20 mm for fewer than 1,000 bodies).

    \b
    ipman figure stability -o out
    ipman figure stability --data amass --path AMASS/ --every 30 --models models/ -o out
    ipman figure stability --data amass --path AMASS/ --data moyo --path MOYO/ --every 60 --models models/ -o out
    """
    from ..paper_figures import stability_distribution as library
    from . import console

    return library.stability_distribution(library.of_data_sets(data, people, every, preset, console.progress))


@figure.command()
@_drawn
@click.option(
    "--width",
    "alpha2",
    type=float,
    default=0.15,
    show_default=True,
    metavar="M",
    help="α2, the width of the pull's tanh.",
)  # fmt: skip
@click.option(
    "--push-width", "beta2", type=float, default=0.15, show_default=True, metavar="M", help="β2, that of the push."
)
@click.option("--body", default="anny", show_default=True, metavar="NAME", help="Whose pictures: anny or anny-lite.")
def pull(alpha2: float, beta2: float, body: str) -> PaperFigure:
    """The gradient of L_pull over height, and a floating and a sinking body in the colours of pull and push.

    The paper says that the gradient is minimal beyond 15 to 20 cm; the numbers say what of its peak is left there.

    \b
    ipman figure pull -o out
    ipman figure pull --width 0.5 -o out       the width of the authors' class, before the trained configuration
    """
    from ..paper_figures.pull_gradient import pull_gradient
    from . import console

    try:
        with console.busy("drawing"):
            return pull_gradient(alpha2=alpha2, beta2=beta2, body=body)
    except ValueError as error:
        raise click.UsageError(str(error)) from error


@figure.command()
@_drawn
@click.argument("body", metavar="BODY")
@click.option("--frame", type=click.IntRange(0), help="Of a sequence, from 0. Default: the first.")
@click.option("--body", "model", metavar="NAME|PATH", help="Body model, as of `ipman analyze`.")
@click.option("--up", type=UP, metavar="AXIS", default=None, help="What points up, as of `ipman analyze`.")
@click.option(
    "--ground", type=GROUND, default="auto", show_default=True, metavar="HEIGHT|auto",
    help="Height of the ground along that axis in metres; auto: under the lowest vertex.",
)  # fmt: skip
@click.option("--parts", type=click.Path(path_type=Path), metavar="FILE", help="Body parts, as of `ipman analyze`.")
@of_files
@preset
def com(body: str, frame: int | None, preset: str, **request: Any) -> PaperFigure:
    """The formulations of the centre of mass on one body, with the CoP and that of binary contact (Fig. S.3).

    BODY is a file as `ipman analyze` reads it, or a named pose of `ipman demo` on the built-in body.

    \b
    ipman figure com warrior -o out
    ipman figure com scan.ply --up z -o out
    """
    from ..paper_figures.center_of_mass import center_of_mass
    from ..paper_figures.inputs import body_of
    from ..study.from_file import Request
    from . import console

    try:
        one = body_of(body, frame, Request(**request))
    except ValueError as error:
        raise click.UsageError(str(error)) from error
    console.warn_of(body, one.flags)
    with console.busy("drawing"):
        return center_of_mass(one.vertices, one.template, one.ground, one.name, preset)


@figure.command()
@_drawn
@click.option("--data", "name", default="moyo", show_default=True, metavar="NAME", help="Data set with a mat's maps.")
@click.option("--path", required=True, type=click.Path(path_type=Path), help="Folder of the data set.")
@_split
@_option
@_models
@click.option("--frame", metavar="NAME|N", help="Name of the frame, or its number from 0. Default: the heaviest map's.")
@preset
def pressure(name: str, path: Path, frame: str | None, preset: str, **options: Any) -> PaperFigure:
    """Estimated beside measured pressure of one frame on a mat, with CoPs and CoM (Fig. 6).

    IoU and CoP error as in `ipman evaluate --table biomech`: at the preset's α and γ, and at the best of the paper's
    grid for this frame.

    \b
    ipman figure pressure --path MOYO/ --models models/ -o out
    ipman figure pressure --path MOYO/ --models models/ --frame 220923_yogi_body_hands_03596_Tree_-b/00200 -o out
    """
    from ..paper_figures import pressure as library
    from . import console

    data = _opened_later((name,), (path,), options)
    number = int(frame) if frame is not None and frame.isdecimal() else frame
    with console.busy("measuring and drawing"), data.open() as opened:
        return library.pressure(library.of_data_set(*next(opened), number, data.models), preset)


@figure.command()
@_drawn
@_data_sets
@_people
@click.option(
    "--most", type=click.IntRange(1), default=2000, show_default=True, help="Poses of a data set, evenly spaced."
)
@click.option("--perplexity", type=float, default=30.0, show_default=True, help="About how many neighbours count.")
@click.option("--seed", type=click.IntRange(0), default=0, show_default=True, help="Of t-SNE.")
def poses(data: DataSets, people: int, most: int, perplexity: float, seed: int) -> PaperFigure:
    """A map of body poses by t-SNE, coloured by data set; without --data of built people, coloured by family.

    A pose is the rotation of 21 joints, without the root: neither where somebody faces nor their shape counts. No body
    models are needed. Needs scikit-learn (the extra figures).

    \b
    ipman figure poses -o out
    ipman figure poses --data amass --path AMASS/ --data moyo --path MOYO/ --most 3000 -o out
    """
    from ..paper_figures import poses as library
    from . import console

    groups = library.of_data_sets(data, people, most, console.progress)
    with console.busy(f"mapping {sum(len(each.values) for each in groups):,} poses"):
        return library.poses(groups, perplexity, seed)


@figure.command()
@_drawn
@click.argument("methods", nargs=-1, required=True, metavar="METHOD...", type=click.Path(path_type=Path))
@click.option(
    "--title", "titles", multiple=True, metavar="TEXT", help="Of each method, in their order. Default: their names."
)
@click.option("--person", "people", multiple=True, metavar="NAME", help="A person to show; may be repeated.")
@click.option("--most", type=click.IntRange(1), default=4, show_default=True, help="People, where none is named.")
@click.option(
    "--photos", type=click.Path(file_okay=False, path_type=Path), metavar="FOLDER",
    help="Where the photos are, called as the people, if not where they were fitted.",
)  # fmt: skip
@click.option("--body", metavar="PATH", help="Model file of fitted folders, if not an embedded body.")
@click.option("--data", "name", metavar="NAME", help="With files of predictions: their data set, for image and camera.")
@click.option("--path", type=click.Path(path_type=Path), help="With --data: where it is.")
@_split
@_option
@click.option(
    "--image-folder", "images", type=click.Path(file_okay=False, path_type=Path), default=Path(),
    help="With --data: where the paths of its images begin.",
)  # fmt: skip
@_models
@preset
def compare(
    methods: tuple[Path, ...],
    titles: tuple[str, ...],
    people: tuple[str, ...],
    most: int,
    photos: Path | None,
    body: str | None,
    name: str | None,
    path: Path | None,
    images: Path,
    preset: str,
    **options: Any,
) -> PaperFigure:
    """A grid of people: their image, and by each method the body over it, from the side, and its pressure.

    METHOD is a folder of `ipman fit` or `ipman predict`; or, with --data, a file of predictions as `ipman evaluate`
    reads it, or the folder of `ipman fit --data` with one. Usually there are two, a baseline and ours. People are found
    by name; where their image cannot be read they are drawn on white. The numbers: margin of support, CoM–CoP distance,
    BoSE, penetration and hover of each.

    \b
    ipman fit photos/ -o out/x --preset smplify-x && ipman fit photos/ -o out/star --preset ipman-o-star
    ipman figure compare out/x out/star --title SMPLify-X --title 'IPMAN-O*' -o out
    ipman figure compare hmr.npz ours.npz --data rich-ipman --path RICH/ --image-folder RICH/ --models models/ -o out
    ipman figure compare fit/xmc fit/o --data moyo --path MOYO/ --option camera=1 --models models/ -o out
    """
    from ..paper_figures import estimated_people as library
    from ..paper_figures.comparison import comparison
    from ..paper_figures.inputs import numbered
    from . import console

    if titles and len(titles) != len(methods):
        raise click.UsageError(f"--title: expected {len(methods)}, one a method, or none; got {len(titles)}")
    if (name is None) != (path is None):
        raise click.UsageError("expected --data together with --path")
    names = titles or numbered([method.resolve().stem for method in methods])
    if len(set(names)) < len(names):
        raise click.UsageError("--title: expected a title for each method that no other has")
    file = next((method for method in methods if method.is_file()), None)
    if path is None and file is not None:
        raise click.UsageError(f"{file}: is a file; name the data set that it predicts with --data and --path")
    data = _opened_later(() if name is None else (name,), () if path is None else (path,), options)
    with data.open() as opened:
        truth = next(opened, None)
        estimates = [
            library.FittedFolder(each, photos, body)
            if truth is None
            else library.predicted(each, truth[1], data.models, images)
            for each in methods
        ]
        with console.progress("drawing people", len(people) or most) as step:
            return comparison([*zip(names, estimates, strict=True)], people, most, preset, step.to)
