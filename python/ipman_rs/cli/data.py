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

COLORS = {"ok": "green", "odd": "yellow", "missing": "yellow", "wrong": "red"}


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
    from ..data import check_download, is_complete
    from . import console

    _module(dataset)
    with console.busy(f"looking at {path}"):
        findings = check_download(dataset, path)
    complete = is_complete(findings)
    if as_json:
        listed = [vars(each) for each in findings]
        record = {"dataset": dataset, "path": str(path), "complete": complete, "findings": listed}
        click.echo(json.dumps(record, ensure_ascii=False, indent=1))
    else:
        _print(findings, dataset, complete)
    sys.exit(0 if complete else 1)


def _module(dataset: str) -> ModuleType:
    from ..data import DATASETS, module

    if dataset not in DATASETS:
        raise click.BadParameter(f"expected one of {', '.join(DATASETS)}, got {dataset!r}", param_hint="DATASET")
    return module(dataset)


def _print(findings: list[Finding], dataset: str, complete: bool) -> None:
    from . import console

    rows = [([each.level, each.what, each.remedy], COLORS[each.level]) for each in findings]
    console.print_colored(("", "found", "what to do"), rows, "", {"found": 2, "what to do": 1})
    counts = {level: sum(each.level == level for each in findings) for level in ("missing", "wrong", "odd", "ok")}
    listed = ", ".join(f"{count} {level}" for level, count in counts.items() if count)
    verdict = f"{listed}; `ipman data layout {dataset}` says what is expected"
    console.say(f"\n{dataset}: {'complete and right' if complete else verdict}")
