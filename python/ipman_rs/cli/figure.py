"""`ipman figure`: the paper's figures from any data. Heavy imports wait until a command runs."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from .figure_inputs import models_in, one_body, one_line_errors, opened_data_sets, told_apart
from .options import GROUND, PRESETS, UP, Setting, of_files

if TYPE_CHECKING:
    from ..paper_figures import PaperFigure

PEOPLE = 210  # built ones: seven families in turn

_output = click.option(
    "-o", "--output", required=True, type=click.Path(file_okay=False, path_type=Path), help="Output folder."
)
_preset = click.option(
    "--preset", type=click.Choice(PRESETS), default="paper-r", show_default=True, help="Constants of the formulas."
)
_models = click.option(
    "--models", type=click.Path(path_type=Path), metavar="FOLDER",
    help="Body models: SMPL_NEUTRAL.pkl, SMPLX_MALE.npz … anywhere below it.",
)  # fmt: skip
_split = click.option("--split", metavar="NAME", help="Part of the data sets, such as test.")
_option = click.option(
    "--option", "options", type=Setting(), multiple=True, help="Of the data set's reader, such as frame_rate=30."
)
_people = click.option(
    "--people", type=click.IntRange(1), default=PEOPLE, show_default=True,
    help="Without --data: so many built people at rest (some ten a second).",
)  # fmt: skip


def _data_sets(command):
    """Options of commands that take one or several data sets."""
    data = click.option(
        "--data", "names", multiple=True, metavar="NAME",
        help="Data set of `ipman data list`, or own (as of `ipman evaluate`); may be repeated, each with its --path.",
    )  # fmt: skip
    path = click.option(
        "--path", "paths", multiple=True, type=click.Path(path_type=Path), help="Folder or file of the data set."
    )
    return data(path(_split(_option(command))))


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
@_output
@_data_sets
@_models
@_people
@click.option("--every", type=click.IntRange(1), default=1, show_default=True, help="Take each n-th frame.")
@_preset
def stability(
    output: Path, names: tuple[str, ...], paths: tuple[Path, ...], split: str | None,
    options: tuple[tuple[str, Any], ...], models: Path | None, people: int, every: int, preset: str,
) -> None:  # fmt: skip
    """The distribution of L_stability, CoM to CoP on the ground, over data sets; the paper says that it peaks at 0.

    Without --data of built people whose balance is known. The numbers: median, percentiles, the share below 50 mm, and
    the fullest bin (10 mm wide, 20 mm for fewer than 1,000 bodies).

    \b
    ipman figure stability -o out
    ipman figure stability --data amass --path AMASS/ --every 30 --models models/ -o out
    ipman figure stability --data amass --path AMASS/ --data moyo --path MOYO/ --every 60 --models models/ -o out
    """
    from . import console

    with one_line_errors(output):
        from ..paper_figures import stability_distribution as made

        losses = []
        for name, data in opened_data_sets(names, paths, split, options, models_in(models)):
            with console.progress(f"measuring {name}", len(range(0, len(data), every))) as step:
                losses.append(made.of_data_set(name, data, models_in(models), every, preset, step.to))
        if not names:
            with console.progress("building people", people) as step:
                losses.append(made.of_built_people(people, preset, step.to))
        found = made.stability_distribution(losses)
        _write(found, output)
    for each in found.numbers["data"]:
        low, high = (1e3 * edge for edge in each["peak_m"])
        console.say(
            f"{each['name']}: {each['bodies']:,} bodies, median {1e3 * each['median_m']:.0f} mm, "
            f"{100 * each['share_below_50_mm']:.0f} % below 50 mm; peaks at {low:.0f}–{high:.0f} mm (the paper: at 0)"
        )
    _say(found, output)


@figure.command()
@_output
@click.option(
    "--width", type=float, default=0.15, show_default=True, metavar="M", help="α2, the width of the pull's tanh."
)
@click.option("--push-width", type=float, default=0.15, show_default=True, metavar="M", help="β2, that of the push.")
@click.option("--body", default="anny", show_default=True, metavar="NAME", help="Whose pictures: anny or anny-lite.")
def pull(output: Path, width: float, push_width: float, body: str) -> None:
    """The gradient of L_pull over height, and a floating and a sinking body in the colours of pull and push.

    The paper says that the gradient is minimal beyond 15 to 20 cm; the numbers say what of its peak is left there.

    \b
    ipman figure pull -o out
    ipman figure pull --width 0.5 -o out       the width of the authors' class, before the trained configuration
    """
    from . import console

    with one_line_errors(output):
        from ..body import embedded
        from ..paper_figures import pull_gradient as made

        for name, value in (("--width", width), ("--push-width", push_width)):
            if not 0 < value < 100:
                raise click.UsageError(f"{name}: expected metres above 0, got {value:g}")
        if body not in embedded.NAMES:
            raise click.UsageError(f"--body: expected one of {', '.join(embedded.NAMES)}, got {body!r}")
        with console.busy("drawing"):
            found = made.pull_gradient(alpha2=width, beta2=push_width, body=body)
            _write(found, output)
    shares = found.numbers["share_of_peak"]
    console.say(
        f"gradient of L_pull: largest at {100 * found.numbers['peak_m']:.1f} cm; of that "
        + ", ".join(f"{100 * share:.0f} % at {100 * float(at):.0f} cm" for at, share in shares.items())
    )
    console.say(
        f"the paper's “minimal beyond 15–20 cm”: {'holds' if found.numbers['claim_holds'] else 'does not hold'}"
    )
    _say(found, output)


@figure.command()
@click.argument("body", metavar="BODY")
@_output
@click.option("--frame", type=click.IntRange(0), help="Of a sequence, from 0. Default: the first.")
@click.option("--body", "model", metavar="NAME|PATH", help="Body model, as of `ipman analyze`.")
@click.option("--up", type=UP, metavar="AXIS", default=None, help="What points up, as of `ipman analyze`.")
@click.option(
    "--ground", type=GROUND, default="auto", show_default=True, metavar="HEIGHT|auto",
    help="Height of the ground along that axis in metres; auto: under the lowest vertex.",
)  # fmt: skip
@click.option("--parts", type=click.Path(path_type=Path), metavar="FILE", help="Body parts, as of `ipman analyze`.")
@of_files
@_preset
def com(body: str, output: Path, frame: int | None, preset: str, **request: Any) -> None:
    """The formulations of the centre of mass on one body, with the CoP and that of binary contact (Fig. S.3).

    BODY is a file as `ipman analyze` reads it, or a named pose of `ipman demo` on the built-in body.

    \b
    ipman figure com warrior -o out
    ipman figure com scan.ply --up z -o out
    """
    from . import console

    with one_line_errors(output):
        from ..paper_figures import center_of_mass as made

        vertices, template, floor, name = one_body(body, frame, request)
        with console.busy("drawing"):
            found = made.center_of_mass(vertices, template, floor, name, preset)
            _write(found, output)
    rows = [
        [key, f"{100 * each['height_m']:.1f}", f"{1e3 * each['to_exact_m']:.0f}", *_millimetres(each)]
        for key, each in found.numbers["centers_of_mass"].items()
    ]
    console.print_rows(["centre of mass", "height cm", "from exact mm", "from CoP mm", "from binary CoP mm"], rows)
    _say(found, output)


def _millimetres(about: dict[str, Any]) -> list[str]:
    distances = (about[f"to_{kind}center_of_pressure_on_ground_m"] for kind in ("", "binary_"))
    return ["–" if value != value else f"{1e3 * value:.0f}" for value in distances]


@figure.command()
@_output
@click.option("--data", "name", default="moyo", show_default=True, metavar="NAME", help="Data set with a mat's maps.")
@click.option("--path", required=True, type=click.Path(path_type=Path), help="Folder of the data set.")
@_split
@_option
@_models
@click.option("--frame", metavar="NAME|N", help="Name of the frame, or its number from 0. Default: the heaviest map's.")
@_preset
def pressure(
    output: Path, name: str, path: Path, split: str | None, options: tuple[tuple[str, Any], ...], models: Path | None,
    frame: str | None, preset: str,
) -> None:  # fmt: skip
    """Estimated beside measured pressure of one frame on a mat, with CoPs and CoM (Fig. 6).

    IoU and CoP error as in `ipman evaluate --table biomech`: at the preset's α and γ, and at the best of the paper's
    grid for this frame.

    \b
    ipman figure pressure --path MOYO/ --models models/ -o out
    ipman figure pressure --path MOYO/ --models models/ --frame 220923_yogi_body_hands_03596_Tree_-b/00200 -o out
    """
    from . import console

    with one_line_errors(output):
        from ..paper_figures import pressure as made

        ((_, data),) = opened_data_sets((name,), (path,), split, options, models_in(models))
        with console.busy("measuring and drawing"):
            asked = int(frame) if frame is not None and frame.isdecimal() else frame
            found = made.pressure(made.of_data_set(name, data, asked, models_in(models)), preset)
            _write(found, output)
    numbers, best = found.numbers, found.numbers["best_of_the_grid"]
    console.say(
        f"{numbers['frame']}: IoU {numbers['iou']:.3f}, CoP {1e3 * numbers['cop_error_m']:.0f} mm off; the best of the "
        f"paper's grid {best['iou']:.3f}, {1e3 * best['cop_error_m']:.0f} mm"
    )
    _say(found, output)


@figure.command()
@_output
@_data_sets
@_people
@click.option(
    "--most", type=click.IntRange(1), default=2000, show_default=True, help="Poses of a data set, evenly spaced."
)
@click.option("--perplexity", type=float, default=30.0, show_default=True, help="About how many neighbours count.")
@click.option("--seed", type=click.IntRange(0), default=0, show_default=True, help="Of t-SNE.")
def poses(
    output: Path, names: tuple[str, ...], paths: tuple[Path, ...], split: str | None,
    options: tuple[tuple[str, Any], ...], people: int, most: int, perplexity: float, seed: int,
) -> None:  # fmt: skip
    """A map of body poses by t-SNE, coloured by data set; without --data of built people, coloured by family.

    A pose is the rotation of 21 joints, without the root: neither where somebody faces nor their shape counts. No body
    models are needed. Needs scikit-learn (the extra figures).

    \b
    ipman figure poses -o out
    ipman figure poses --data amass --path AMASS/ --data moyo --path MOYO/ --most 3000 -o out
    """
    from . import console

    with one_line_errors(output):
        from ..paper_figures import poses as made

        groups = []
        for name, data in opened_data_sets(names, paths, split, options, models_in(None)):
            with console.progress(f"reading {name}", min(most, len(data))) as step:
                groups.append(made.of_data_set(name, data, most, step.to))
        if not names:
            with console.progress("building people", people) as step:
                groups = made.of_built_people(people, step.to)
        with console.busy(f"mapping {sum(len(each.values) for each in groups):,} poses"):
            found = made.poses(groups, perplexity, seed)
            _write(found, output)
    numbers = found.numbers
    console.say(
        f"{numbers['poses']:,} poses; the nearest neighbour is of the same group in "
        f"{100 * numbers['nearest_neighbour_of_same_group']:.0f} % "
        f"({100 * numbers['nearest_neighbour_of_same_group_by_chance']:.0f} % by chance)"
    )
    _say(found, output)


@figure.command()
@click.argument("methods", nargs=-1, required=True, metavar="METHOD...", type=click.Path(path_type=Path))
@_output
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
@_preset
def compare(
    methods: tuple[Path, ...], output: Path, titles: tuple[str, ...], people: tuple[str, ...], most: int,
    photos: Path | None, body: str | None, name: str | None, path: Path | None, split: str | None,
    options: tuple[tuple[str, Any], ...], images: Path, models: Path | None, preset: str,
) -> None:  # fmt: skip
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
    from . import console

    if titles and len(titles) != len(methods):
        raise click.UsageError(f"--title: expected {len(methods)}, one a method, or none; got {len(titles)}")
    if (name is None) != (path is None):
        raise click.UsageError("expected --data together with --path")
    names = titles or told_apart([method.resolve().stem for method in methods])
    if len(set(names)) < len(names):
        raise click.UsageError("--title: expected a title for each method that no other has")
    with one_line_errors(output):
        from ..paper_figures import comparison as made
        from ..paper_figures.estimated_people import PREDICTIONS, FittedFolder, Predicted

        found_by: list[tuple[str, Any]] = []
        opened = (
            None
            if name is None or path is None
            else next(opened_data_sets((name,), (path,), split, options, models_in(models)))[1]
        )
        for title, method in zip(names, methods, strict=True):
            if opened is None and method.is_file():
                raise click.UsageError(
                    f"{method}: is a file; name the data set that it predicts with --data and --path"
                )
            if opened is None:
                found_by.append((title, FittedFolder(method, photos, body)))
            else:
                file = method / PREDICTIONS if method.is_dir() else method
                found_by.append((title, Predicted(file, opened, models_in(models), images)))
        with console.progress("drawing people", len(people) or most) as step:
            found = made.comparison(found_by, people, most, preset, step.to)
        _write(found, output)
    rows = [
        [person, method, made.caption(about)]
        for person, each in found.numbers["people"].items()
        for method, about in each.items()
    ]
    console.print_rows(["person", "method", "stands"], rows)
    _say(found, output)


def _write(found: PaperFigure, output: Path) -> None:
    from .. import paper_figures

    paper_figures.write(found, output)


def _say(found: PaperFigure, output: Path) -> None:
    from . import console

    console.say(f"figure: {(output / f'{found.name}.png').resolve()}")
