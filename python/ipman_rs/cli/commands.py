"""The commands of `ipman` and their options."""

from __future__ import annotations

import errno
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from ..files.errors import FileError, one_line
from .benchmark import benchmark
from .data import data
from .evaluate import evaluate
from .figure import figure
from .fit import fit
from .flags import usage, with_flags
from .options import GROUND, RESUMES, UP, of_files, preset
from .predict import predict
from .simulate import simulate
from .train import train
from .validate import validate
from .warned import warnings_in_one_line

if TYPE_CHECKING:
    from ..view import Study

_LEAST = 400_000_000  # bytes of address space: with less, NumPy and SciPy take minutes to load, or fail in C

_CONTEXT = {"help_option_names": ["-h", "--help"], "max_content_width": 110}


def _version(context: click.Context, _parameter: click.Parameter, wanted: bool) -> None:
    if wanted and not context.resilient_parsing:
        import ipman_rs as ip

        click.echo(f"ipman {ip.__version__}")
        context.exit()


def _limit() -> str:
    """What is wrong with the limit of this process's address space; nothing on systems that do not hold to it."""
    if sys.platform != "linux":
        return ""
    import resource

    limit, _ = resource.getrlimit(resource.RLIMIT_AS)
    if limit == resource.RLIM_INFINITY or limit >= _LEAST:
        return ""
    limited = f"memory is limited to {limit / 1e6:.0f} MB (ulimit -v), but NumPy and SciPy need {_LEAST / 1e6:.0f}"
    return f"{limited}; raise the limit"


class _Commands(click.Group):
    """What no command can do anything about ends in one line: a name that no file can have, a full disk, no memory."""

    def invoke(self, ctx: click.Context) -> Any:
        for stream in (sys.stdout, sys.stderr):  # names of files need not be text, and terminals not know all letters
            if hasattr(stream, "reconfigure"):
                stream.reconfigure(errors="backslashreplace")  # type: ignore[union-attr]
        message = _limit()
        try:
            if not message:
                return super().invoke(ctx)
        except KeyboardInterrupt:
            kept = "; what is finished is kept" if RESUMES in ctx.meta else ""
            click.echo(f"ipman: interrupted{kept}", err=True)
            sys.exit(130)
        except click.UsageError as error:
            with error.ctx or ctx:
                words = usage(with_flags(error.message), error.ctx)
                error.message = words  # pyright: ignore[reportAttributeAccessIssue] - each kind formats it its own way
            raise
        except MemoryError:
            message = "needs more memory than there is"
        except OSError as error:
            if error.errno == errno.EPIPE:  # whoever read the output has left
                raise
            message = f"{error.filename}: {error.strerror}" if error.filename and error.strerror else str(error)
        click.echo(f"ipman: error: {one_line(message)}", err=True)
        sys.exit(1)


@click.group(cls=_Commands, context_settings=_CONTEXT)
@click.option("--version", is_flag=True, is_eager=True, expose_value=False, callback=_version, help="Show the version.")
@click.pass_context
def main(context: click.Context) -> None:
    """Intuitive physics of 3D human bodies: pressure, centre of mass, base of support and balance.

    \b
    ipman demo -o out               the named poses of the built-in body
    ipman analyze body.obj -o out   your own mesh; open out/report.html afterwards
    ipman fit photo.jpg -o out      a body for the person in a photo
    ipman evaluate pred.npz --data own --path true.npz -o out   predictions against the truth
    ipman validate folder/ -o out   the engine against force plates and OpenSim
    ipman figure pull -o out        the paper's figures, as PNG, SVG and numbers
    ipman simulate body.obj         how firmly it stands, and what becomes of it when it is let go
    """
    context.with_resource(warnings_in_one_line())


main.add_command(fit)
main.add_command(simulate)
main.add_command(benchmark)
main.add_command(train)
main.add_command(predict)
main.add_command(evaluate)
main.add_command(validate)
main.add_command(data)
main.add_command(figure)


@main.command()
@click.option("-o", "--output", required=True, type=click.Path(file_okay=False, path_type=Path), help="Report folder.")
@preset
def demo(output: Path, preset: str) -> None:
    """Analyse the named poses of the built-in body: a table here, the report in the output folder."""
    import ipman_rs as ip

    from ..study.named_poses import named_poses
    from . import console
    from .report import write

    study = named_poses(ip.load_body("anny"), preset, console.progress)
    page = write([study], output, [])
    console.print_table([study])
    console.say(f"report: {page}")


@main.command()
@click.argument("bodies", nargs=-1, required=True, metavar="BODY...", type=click.Path(path_type=Path))
@click.option("-o", "--output", type=click.Path(file_okay=False, path_type=Path), help="Report folder.")
@click.option(
    "--body", "model", metavar="NAME|PATH",
    help="Body model that parameters pose: anny, anny-lite, or an SMPL, SMPL+H or SMPL-X file (.pkl, .npz). "
    "Default: the one that the file names, or anny.",
)  # fmt: skip
@click.option(
    "--up", type=UP, metavar="AXIS", default=None,
    help="What points up: x, y, z, -x, -y, -z or a normal such as 0,0.1,1. Default: y, and z for AMASS files.",
)  # fmt: skip
@click.option(
    "--ground", type=GROUND, default="auto", show_default=True, metavar="HEIGHT|auto",
    help="Height of the ground along that axis in metres; auto: the lowest vertex of each body lies on it.",
)  # fmt: skip
@click.option(
    "--parts", type=click.Path(path_type=Path), metavar="FILE",
    help="Body parts of a mesh: JSON {part: [vertex ids]}, or one label a face (.json, .npy, .npz).",
)  # fmt: skip
@of_files
@preset
@click.option("--json", "as_json", is_flag=True, help="Print report.json to stdout and nothing else there.")
def analyze(
    bodies: tuple[Path, ...],
    output: Path | None,
    model: str | None,
    up: tuple[float, float, float] | None,
    ground: float | None,
    parts: Path | None,
    preset: str,
    as_json: bool,
    **reading: Any,
) -> None:
    """Analyse bodies and write a report: report.html, report.json, report.npz and pictures.

    BODY is a mesh in metres (.obj .ply .glb .stl, or .npz with vertices and faces), or the parameters of a body model
    (.npz: poses/betas/trans as AMASS ships them, or global_orient/body_pose/betas/transl, or pose/betas/transl).
    Vertices (T, V, 3) and parameters over time are sequences. Several bodies come into one report, each with its own
    folder of pictures. What cannot be a person is refused, and what is odd is marked with ! in the table.

    \b
    ipman analyze scan.ply -o out --up z            a scan of a z-up scanner, its lowest point on the floor
    ipman analyze smpl.obj -o out --parts parts.json
    ipman analyze walk_poses.npz -o out --body SMPLH_NEUTRAL.pkl
    ipman analyze *.obj -o out --ground 0           several bodies on the plane y = 0
    ipman analyze scan.stl -o out --units mm        a scan in millimetres
    ipman analyze scan.ply --json | jq .bodies[0].frames[0].margin

    Exit code: 0 when all is well, 1 when a file could not be analysed (the others are), 2 for wrong usage.
    """
    if output is None and not as_json:
        raise click.UsageError("Missing option '-o' / '--output' (or '--json' to print the numbers only).")
    from ..study.from_file import Request, analyze_file
    from . import console
    from .report import print_json, write

    request = Request(model=model, up=up, ground=ground, parts=parts, preset=preset, **reading)
    studies: list[Study] = []
    failures: list[tuple[str, str]] = []
    for path in bodies:
        try:
            studies.append(analyze_file(path, request, console.progress))
            console.warn_of(path, studies[-1].flags)
        except FileError as error:
            failures.append((str(path), error.what))
            console.error(str(error))
    # The report first: a reader that closes stdout early (`| head`) must not cost it.
    page = write(studies, output, failures) if studies and output is not None else None
    if as_json:
        print_json(studies, failures)
    elif studies:
        console.print_table(studies)
        console.print_notes(studies)
        console.say(f"report: {page}")
    sys.exit(1 if failures else 0)
