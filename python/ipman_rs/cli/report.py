"""The report of studies: as a page in a folder, and as JSON on stdout."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from .errors import writing

if TYPE_CHECKING:
    from ..study import Study


def write(studies: list[Study], output: Path, failures: list[tuple[str, str]], own_folders: bool = False) -> Path:
    """The report's page. Ends the command where nothing can be written."""
    from ..view.report import count_files, write_report
    from . import console

    with writing(output, "the report"), console.progress("writing the report", count_files(studies)) as step:
        options = {"progress": lambda _name: step.one(), "own_folders": own_folders}
        return write_report(studies, output, failures, **options).resolve()
    raise AssertionError  # `writing` ends the command


def print_json(studies: list[Study], failures: list[tuple[str, str]]) -> None:
    import json

    from ..view.record import report_record

    record: dict[str, Any] = report_record(studies, failures)
    click.echo(json.dumps(record, allow_nan=False, ensure_ascii=False, indent=1))
