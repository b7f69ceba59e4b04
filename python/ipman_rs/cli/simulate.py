"""`ipman simulate`: how firmly stiff bodies stand, and what becomes of them when they are let go."""

from __future__ import annotations

import json
import sys
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from ..files.errors import FileError, one_line
from .options import GROUND, TIMES, UP, of_files

if TYPE_CHECKING:
    from ..simulation.inputs import GroundedBodies
    from ..simulation.report import Fall

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
    from ..simulation.comparison_report import (
        compare_falls,
        comparison_lines,
        comparison_record,
        comparison_table,
        pairs,
        write_comparison,
    )
    from ..simulation.inputs import read_bodies
    from ..simulation.report import run_falls, write_falls
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
    falls: list[Fall] = []
    failures: list[tuple[str, str]] = []

    @contextmanager
    def reported() -> Iterator[None]:
        try:
            yield
        except FileError as error:
            failures.append((error.path, error.what))
            console.error(str(error))
        except ImportError as error:
            raise click.ClickException(str(error)) from error

    def opened(path: Path) -> GroundedBodies:
        read = read_bodies(path, request, console.progress)
        console.warn_of(path, read.flags)
        return read

    compared = None
    if against is None:
        for path in bodies:
            with reported():
                falls.append(run_falls(opened(path), films, **options, progress=console.progress))
    else:  # what cannot be compared is not simulated
        both: list[GroundedBodies] = []
        for path in (*bodies, against):
            with reported():
                both.append(opened(path))
        with reported():
            if not failures:
                pairs(*both)
                falls += [run_falls(each, films, **options, progress=console.progress) for each in both]
                compared = compare_falls(*falls)
    record: dict[str, Any] = {"bodies": [one.record() for one in falls]}
    if compared is not None:
        record["comparison"] = comparison_record(compared[0], *falls)
    record["failures"] = [dict(zip(("file", "error"), failure, strict=True)) for failure in failures]
    text = json.dumps(record, allow_nan=False, ensure_ascii=False, indent=1)
    if output is not None and falls:
        try:
            write_falls(falls, output, text, console.progress)
            if compared is not None:
                write_comparison(*compared[1:], (falls[0].path, falls[1].path), output)
        except OSError as error:
            console.error(f"{output}: cannot be written ({error.strerror or error}); choose another folder")
            sys.exit(1)
    if as_json:
        click.echo(text)
    elif falls:
        print_falls(falls)
        for one in falls:
            for flag in one.flags:
                console.say(one_line(f"! {one.path}: {flag}"))
            assumed = [note for note in one.notes if note.startswith(("up: ", "ground: "))]
            for note in one.notes:
                if note not in assumed and not note.startswith("parts: "):
                    console.say(one_line(f"{one.path}: {note}"))
            if assumed:
                console.say(one_line(f"{one.path}: {'; '.join(assumed)}"))
        for note in dict.fromkeys(one.without_verdict for one in falls if one.without_verdict):
            console.say(note)
        if compared is not None:
            console.say("")
            console.print_rows(*comparison_table(compared[0]))
            for line in comparison_lines(compared[0], *falls):
                console.say(one_line(line))
        if output is not None:
            console.say(f"results: {output.resolve()}")
    sys.exit(1 if failures else 0)


def print_falls(falls: Sequence[Fall]) -> None:
    """A line for each body of a file; one for all of them where they are many."""
    from rich.console import Console
    from rich.table import Table
    from rich.text import Text

    table = Table(box=None, header_style="bold", pad_edge=False, padding=(0, 1))
    table.add_column("body", overflow="fold", min_width=14)
    for title in falls[0].titles():
        table.add_column(title, justify="right", no_wrap=True)
    table.add_column("stands", no_wrap=True)
    for one in falls:
        for name, cells, stands in one.rows() if one.count <= MOST_ROWS else [one.summary()]:
            style = "" if stands is None else ("green" if stands.startswith(("yes", "100")) else "red")
            table.add_row(one_line(name), *cells, Text(stands or "–", style=style))
    console = Console(highlight=False)
    if not console.is_terminal:
        console.width = 160
    console.print(table)
