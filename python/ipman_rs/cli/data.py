"""`ipman data`: which data sets can be read, whether a download is complete and right; and images made here."""

from __future__ import annotations

import json
import sys
from pathlib import Path
from typing import TYPE_CHECKING

import click

from .render import render

if TYPE_CHECKING:
    from types import ModuleType

    from ..data import Finding

SIGNS = {"ok": ("ok", "green"), "odd": ("odd", "yellow"), "missing": ("missing", "yellow"), "wrong": ("wrong", "red")}


@click.group()
def data() -> None:
    """Data sets of people: what can be read, whether a download is complete and right; and images made here.

    \b
    ipman data list                             the names
    ipman data layout human36m                  its files, axes, units, floor and cameras
    ipman data check human36m data/annotations  what is there, what is missing, what is wrong
    ipman data render -o out/images             images of the built-in body on a known floor
    """


data.add_command(render)


@data.command("list")
def list_() -> None:
    """The names of the data sets, with a line about each."""
    from ..data import DATASETS, module

    width = max(map(len, DATASETS))
    for name in DATASETS:
        click.echo(f"{name:{width}}  {(module(name).__doc__ or '').strip().splitlines()[0]}")


@data.command()
@click.argument("dataset")
def layout(dataset: str) -> None:
    """What DATASET is expected to look like: files, axes, units, frame rate, floor and cameras."""
    click.echo((_module(dataset).__doc__ or "").strip())


@data.command()
@click.argument("dataset")
@click.argument("path", type=click.Path(path_type=Path))
@click.option("--json", "as_json", is_flag=True, help="Print the findings as JSON to stdout and nothing else there.")
def check(dataset: str, path: Path, as_json: bool) -> None:
    """Whether the download of DATASET at PATH, a file or a folder, is complete and right.

    Every file is opened, every number looked at; units, axes, the floor and the cameras are judged by the size and the
    stance of the bodies in a sample of the frames. Nothing in the files is executed.

    \b
    ipman data check human36m data/annotations
    ipman data check 3dpw 3DPW --json | jq '.findings[] | select(.level != "ok")'

    Exit code: 0 when all is there and right, 1 when something is missing or wrong, 2 for wrong usage.
    """
    from . import console

    module = _module(dataset)
    with console.busy(f"looking at {path}"):
        findings = _findings(module, path)
    if as_json:
        listed = [vars(each) for each in findings]
        record = {"dataset": dataset, "path": str(path), "complete": _complete(findings), "findings": listed}
        click.echo(json.dumps(record, ensure_ascii=False, indent=1))
    else:
        _print(findings, dataset)
    sys.exit(0 if _complete(findings) else 1)


def _module(dataset: str) -> ModuleType:
    from ..data import DATASETS, module

    if dataset not in DATASETS:
        raise click.BadParameter(f"expected one of {', '.join(DATASETS)}, got {dataset!r}", param_hint="DATASET")
    return module(dataset)


def _findings(module: ModuleType, path: Path) -> list[Finding]:
    from ..data import Finding

    try:
        return list(module.check(path))
    except (ValueError, OSError, ImportError) as error:  # an extra that is not installed, a disk that fails
        return [Finding("wrong", str(error))]


def _mends(finding: Finding) -> str:
    """The advice, and the option of the commands that take such data."""
    option = "" if finding.option in finding.advice else f"for ipman fit: {finding.option}"
    return "; ".join(part for part in (finding.advice, option) if part)


def _complete(findings: list[Finding]) -> bool:
    return all(each.level in ("ok", "odd") for each in findings)


def _print(findings: list[Finding], dataset: str) -> None:
    from rich.console import Console
    from rich.table import Table
    from rich.text import Text

    from ..files.errors import one_line

    table = Table(box=None, header_style="bold", pad_edge=False, padding=(0, 1))
    table.add_column("", no_wrap=True)
    table.add_column("found", overflow="fold", ratio=2)
    table.add_column("what to do", overflow="fold", ratio=1)
    for each in findings:
        sign, style = SIGNS[each.level]
        table.add_row(Text(sign, style=style), Text(one_line(each.what)), Text(one_line(_mends(each))))
    console = Console(highlight=False)
    if not console.is_terminal:
        console.width = 160
    console.print(table)
    counts = {level: sum(each.level == level for each in findings) for level in SIGNS}
    if _complete(findings):
        console.print(f"\n{dataset}: complete and right", markup=False)
    else:
        said = ", ".join(f"{counts[level]} {level}" for level in ("missing", "wrong", "odd", "ok") if counts[level])
        console.print(f"\n{dataset}: {said}; `ipman data layout {dataset}` says what is expected", markup=False)
