"""`ipman validate`: bodies fitted to markers, against force plates and centres of mass by others."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Any

import click

from ..files.errors import one_line
from ..spellings import METRES
from .errors import writing
from .options import RATE, UNIT, UP, force, needs, resumes, subject


@click.command()
@click.argument("folder", metavar="FOLDER", type=click.Path(path_type=Path))
@click.option("-o", "--output", required=True, type=click.Path(file_okay=False, path_type=Path), help="Output folder.")
@click.option(
    "--body", "model", default="anny-lite", show_default=True, metavar="NAME|PATH",
    help="Body model: anny-lite, anny, or an SMPL, SMPL+H or SMPL-X file (.pkl, .npz).",
)  # fmt: skip
@click.option(
    "--person", default="auto", show_default=True, metavar="auto|none|NAME",
    help="The recording of standing still whose shape and places of markers are kept for all others; auto: the one "
    "whose name says so (static, stand, neutral, calib), or whose markers do, if there is one; none: every recording "
    "finds its own.",
)  # fmt: skip
@click.option(
    "--rate", "pace", type=click.FloatRange(min=0, min_open=True), default=50.0, show_default=True, metavar="HZ",
    help="Fit about so many frames a second. Accelerations, and with them the ZMP, need 24 or more.",
)  # fmt: skip
@click.option(
    "--up", type=UP, metavar="AXIS",
    help="What points up in markers, forces and centres of mass. Default: what a .c3d says, y in .trc, .mot and .sto.",
)  # fmt: skip
@click.option(
    "--units", type=UNIT, metavar="UNIT",
    help="Unit of the lengths in marker files, of plates and centres of mass in a .c3d, too: "
    f"{', '.join(METRES)}, or a number of metres. Default: what they say.",
)  # fmt: skip
@click.option(
    "--force-units", "force_unit", type=click.Choice(["m", "cm", "mm"]), default="m", show_default=True,
    help="Unit of the centres of pressure in .mot and .sto, which do not say it.",
)  # fmt: skip
@click.option(
    "--force-up", type=UP, metavar="AXIS",
    help="What points up in .mot and .sto files of forces, where markers have other axes. Default: as --up.",
)  # fmt: skip
@click.option(
    "--recorded-rate", "rate", type=RATE, metavar="HZ",
    help="Frames a second of the markers, where their files are wrong.",
)  # fmt: skip
@click.option(
    "--markers", type=click.Path(path_type=Path), metavar="FILE",
    help="Places of markers with other names, as `ipman fit --markers` has them.",
)  # fmt: skip
@subject
@force
@click.option("--fresh", is_flag=True, help="Fit again what was fitted before with the same files and options.")
@resumes
def validate(
    folder: Path,
    output: Path,
    model: str,
    person: str,
    pace: float,
    fresh: bool,
    **options: Any,
) -> None:
    """Compare the engine's centre of mass, centre of pressure and pressure with measurements.

    FOLDER holds recordings of one person: markers (.trc, .c3d), force plates (.mot, .sto, or those of the .c3d) and
    centres of mass by others, such as OpenSim's (.sto, or .csv with columns time_s, com_x_m, com_y_m, com_z_m; y up) or
    Plug-in Gait's CentreOfMass in the .c3d. Names and folders say which belong together:
    squats.trc, squats_grf.mot and squats_com.sto; markers_walk.trc and grf_walk.mot; MarkerData/walk.trc and
    ID/walk_grf.mot; walk/markers.trc and walk/grf.mot; or the only two. OpenSim's ExternalLoads (.xml) say in which
    columns forces are. Bodies are fitted to the markers alone, as by `ipman fit`, and are kept: run it again and it
    goes on where it was.

    OUTPUT gets validation.md and validation.json with all tables, and a folder for every recording: series.csv and
    series.npz over time, the fit, and pictures of the pressure on the floor, of what happens over time, of the bodies.

    \b
    ipman validate gait2354 -o out
    ipman validate squats/ -o out --body anny --person static1
    ipman validate squats/ -o out --person none      every recording finds its own shape

    Exit code: 0 when every recording was compared, 1 when one was not (the others are), 2 for wrong usage.
    """
    needs("torch", "roma", "yaml")
    from ..validation import report, run
    from . import console

    try:
        plan = run.plan(folder, output, model, person, pace, not fresh, **options)
    except (ValueError, ImportError) as error:
        raise click.UsageError(str(error)) from error
    with writing(output, "outputs"):
        records, notes, failures = run.run(plan, console.progress)
        page = run.write(plan, records, notes, failures) if records else None
    for failure in failures:
        console.error(str(failure))
    if page is not None:
        head, rows = report.phase_table(records)
        console.print_colored(head, [(row, "") for row in rows], "", {"recording": None})
    for line in report.flag_lines(records):
        console.say(one_line(line))
    for line in (*notes, *([] if page is None else [f"report: {page}"])):
        console.say(line)
    sys.exit(1 if failures else 0)
