"""`ipman simulate`: how firmly stiff bodies stand, and what becomes of them when they are let go."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from ..files.errors import one_line
from .errors import writing
from .options import GROUND, TIMES, UP, of_files

if TYPE_CHECKING:
    from ..simulation.files import Falls

MOST_ROWS = 40


@click.command()
@click.argument("bodies", nargs=-1, required=True, metavar="BODY...", type=click.Path(path_type=Path))
@click.option(
    "--against", type=click.Path(path_type=Path), metavar="OTHER",
    help="Compare with the same people's bodies by another method.",
)  # fmt: skip
@click.option("-o", "--output", type=click.Path(file_okay=False, path_type=Path), help="Folder for the results.")
@click.option("--body", "model", metavar="NAME|PATH", help="Body model that parameters pose, as in `ipman analyze`.")
@click.option("--up", type=UP, metavar="AXIS", default=None, help="What points up, as in `ipman analyze`.")
@click.option(
    "--ground", type=GROUND, default="auto", show_default=True, metavar="HEIGHT|auto",
    help="Height of the ground along that axis in metres; auto: through the lowest vertex of all frames.",
)  # fmt: skip
@click.option("--parts", type=click.Path(path_type=Path), metavar="FILE", help="Body parts of a mesh.")
@of_files
@click.option(
    "--engine", type=click.Choice(("rapier", "bullet", "mujoco")), default="rapier", show_default=True,
    help="rapier is built in; the others need pip install 'ipman_rs[bullet]' or 'ipman_rs[mujoco]'.",
)  # fmt: skip
@click.option(
    "--shape", type=click.Choice(("hull", "vhacd")), default="hull", show_default=True,
    help="What touches: the convex hull (exact on a plane), or the paper's V-HACD.",
)  # fmt: skip
@click.option(
    "--times", type=TIMES, default="0.41667,2", show_default=True, metavar="SECONDS,...",
    help="When to look; the first is the paper's 100 steps of 1/240 s. Who stands is judged at 2 s or later.",
)  # fmt: skip
@click.option("--step", type=click.FloatRange(1e-5, 0.1), default=1 / 240, show_default="1/240", help="Seconds.")
@click.option("--friction", type=click.FloatRange(0.0, 100.0), default=1.0, show_default=True, help="Coulomb's.")
@click.option(
    "--snap/--no-snap", default=True, show_default=True,
    help="Put the lowest point of each body on the ground first; else it starts where it is, also in the air.",
)  # fmt: skip
@click.option("--tip-only", is_flag=True, help="The tip test alone: no simulation, thousands of bodies a second.")
@click.option(
    "--filmstrips", type=click.IntRange(0, 1000), default=6, show_default=True,
    help="Pictures of so many falls a file, evenly spaced over its bodies (with -o).",
)  # fmt: skip
@click.option("--json", "as_json", is_flag=True, help="Print simulation.json to stdout and nothing else there.")
def simulate(
    bodies: tuple[Path, ...],
    against: Path | None,
    output: Path | None,
    model: str | None,
    up: tuple[float, float, float] | None,
    ground: float | None,
    parts: Path | None,
    as_json: bool,
    units: float,
    degrees: bool,
    rate: float | None,
    force: bool,
    **options: Any,
) -> None:
    """Let stiff bodies go on their ground: do they stand or fall?

    BODY is a mesh or the parameters of a body model, one body or many, as in `ipman analyze`; predictions, as in
    `ipman evaluate` (.npz); or a folder of `ipman fit`, with all its bodies. Each body is a rigid one with the mesh's
    exact mass, centre of mass and inertia. The table has for each

    \b
    margin    from the centre of mass to the edge of what it stands on, mm; negative outside
    barrier   what tips it over the nearest edge, J, and the least push, degrees a second
    roll      how far it tilts if nothing is quick, degrees; and after a nudge
    moved     how far its centre of mass has moved after each time, mm; tilt: of its up axis, degrees
    stands    tilted by at most 15 degrees at the last time, if that is 2 s or later; else there is no verdict

    What cannot be a person is refused, and what is odd is marked with ! in the table.

    With --against: the share of stable bodies of both, and the difference and ratio of their displacements, with
    intervals. Bodies are paired by name where both files have names (predictions, folders of fits), else in order;
    where they cannot be paired nothing is simulated.

    With -o: simulation.json, simulation.npz (with each pose on the way) and a filmstrip PNG of each fall; with
    --against also comparison.png and .svg.

    \b
    ipman simulate body.obj
    ipman simulate poses.npz -o out --times 0.41667,2,5
    ipman simulate *.obj -o out --engine mujoco
    ipman simulate million.npz -o out --tip-only
    ipman simulate fits/ipman-o --against fits/smplify-xmc -o out --engine bullet --shape vhacd

    Exit code: 0 when all is well, 1 when a file could not be read (the others are), 2 for wrong usage.
    """
    from ..simulation.files import compare_files, simulate_files
    from ..study.from_file import Request
    from . import console

    if against is not None and (len(bodies) != 1 or options["tip_only"]):
        wrong = "--tip-only" if options["tip_only"] else f"{len(bodies)} files"
        raise click.UsageError(f"--against compares the simulated bodies of one BODY with those of OTHER, got {wrong}")
    request = Request(
        model=model, up=up, ground=ground, parts=parts, units=units, degrees=degrees, rate=rate, force=force
    )
    films = options.pop("filmstrips")
    films = films if output is not None else 0
    try:
        if against is None:
            result = simulate_files(bodies, request, films, console.progress, **options)
        else:
            result = compare_files(bodies[0], against, request, films, console.progress, **options)
    except ImportError as error:
        raise click.ClickException(str(error)) from error
    for path, flags in result.flags:
        console.warn_of(path, flags)
    for failure in result.failures:
        console.error(str(failure))
    if output is not None and result.falls:
        with writing(output):
            result.write(output, console.progress)
    if as_json:
        click.echo(result.record())
    elif result.falls:
        _print(result)
        if output is not None:
            console.say(f"results: {output.resolve()}")
    sys.exit(1 if result.failures else 0)


def _print(result: Falls) -> None:
    """A line for each body of a file, one for all of them where they are many; what is odd; the comparison."""
    from . import console

    rows = []
    for one in result.falls:
        for name, cells, stands in one.rows() if one.count <= MOST_ROWS else [one.summary()]:
            color = "" if stands is None else ("green" if stands.startswith(("yes", "100")) else "red")
            rows.append(([name, *cells, stands or "–"], color))
    console.print_colored(("body", *result.falls[0].titles(), "stands"), rows, "stands", {"body": None})
    for line in result.lines():
        console.say(one_line(line))
    compared = result.comparison()
    if compared is not None:
        head, lines, words = compared
        console.say("")
        console.print_rows(head, lines)
        for line in words:
            console.say(one_line(line))
