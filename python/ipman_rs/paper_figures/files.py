"""The files of a figure: NAME.png and NAME.svg, its numbers in NAME.json, and the data behind them.

The same figure is written to the same bytes, and a file gets its name when it is complete.
"""

from __future__ import annotations

import csv
import io
import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from ipman_rs.files import cell, write_whole
from ipman_rs.jsonable import jsonable
from ipman_rs.view.picture import fix_layout

if TYPE_CHECKING:
    from matplotlib.figure import Figure

DPI = 150


@dataclass(frozen=True, eq=False)
class PaperFigure:
    """A picture and the numbers that it shows.

    numbers: for JSON; what is not finite becomes null. arrays: for NAME.npz, none without any. table: rows of NAME.csv
    by column, none without any. summary: the numbers in lines of text; summary_table: as head and rows.
    """

    name: str
    picture: Figure
    numbers: dict[str, Any]
    arrays: Mapping[str, np.ndarray] = field(default_factory=dict)
    table: Sequence[Mapping[str, Any]] = ()
    summary: Sequence[str] = ()
    summary_table: tuple[Sequence[str], Sequence[Sequence[str]]] | None = None


def write(figure: PaperFigure, folder: Path) -> list[Path]:
    """Writes the files of a figure, the picture first; their paths. OSError where the folder cannot be written."""
    folder.mkdir(parents=True, exist_ok=True)
    fix_layout(figure.picture, DPI)
    contents = {"png": _picture(figure, "png"), "svg": _picture(figure, "svg")}
    record = json.dumps(
        jsonable({"figure": figure.name, **figure.numbers}), allow_nan=False, ensure_ascii=False, indent=1
    )
    contents["json"] = f"{record}\n".encode()
    if figure.arrays:
        contents["npz"] = _packed(figure.arrays)
    if figure.table:
        contents["csv"] = _lines(figure.table)
    written = []
    for ending, content in contents.items():
        path = folder / f"{figure.name}.{ending}"
        write_whole(path, content)
        written.append(path)
    return written


def _picture(figure: PaperFigure, form: str) -> bytes:
    import matplotlib

    stream = io.BytesIO()
    metadata = {"Date": None} if form == "svg" else {}
    with matplotlib.rc_context({"svg.fonttype": "none", "svg.hashsalt": figure.name}):
        figure.picture.savefig(stream, format=form, dpi=DPI, metadata=metadata)
    return stream.getvalue()


def _packed(arrays: Mapping[str, np.ndarray]) -> bytes:
    stream = io.BytesIO()
    np.savez_compressed(stream, allow_pickle=False, **arrays)
    return stream.getvalue()


def _lines(table: Sequence[Mapping[str, Any]]) -> bytes:
    text = io.StringIO()
    lines = csv.DictWriter(text, list(table[0]), lineterminator="\n")
    lines.writeheader()
    lines.writerows(
        {key: cell(value) if isinstance(value, str) else value for key, value in row.items()} for row in table
    )
    return text.getvalue().encode()
