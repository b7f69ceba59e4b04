"""`ipman simulate A --against B`: the bodies of two files in pairs, the table, the record and the picture."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import fields, replace
from pathlib import Path
from typing import Any

import numpy as np

from ..evaluation.statistics.bootstrap import Interval
from ..files import atomic_write
from ..files.errors import FileError
from ..jsonable import jsonable
from ..view.picture import fix_layout
from . import VERDICT, Means, MethodComparison, Simulation, compare
from .comparison import MORE_STABLE_IN_THE_PAPER
from .inputs import GroundedBodies
from .report import Fall

NAME = "comparison"
PNG_DPI = 130
LONGEST = 48  # characters of a file's name in the picture


def compare_falls(first: Fall, second: Fall) -> tuple[MethodComparison, Simulation, Simulation]:
    """The comparison, and the simulations of the bodies that both have, row by row.

    Bodies are paired by their names where both files name them, else in their order. Raises FileError.
    """
    assert first.run is not None
    assert second.run is not None
    rows, others, alone = pairs(first, second)
    one, other = _rows(first.run, rows), _rows(second.run, others)
    try:
        comparison = compare(one, other)
    except ValueError as error:
        raise FileError(second.path, f"cannot be compared with {first.path}: {error}") from error
    return replace(comparison, left_out=comparison.left_out + alone), one, other


def pairs(first: GroundedBodies | Fall, second: GroundedBodies | Fall) -> tuple[list[int], list[int], int]:
    """The rows of either, and how many bodies only one of the two has. Raises FileError where they cannot be paired."""
    if first.names is None or second.names is None:
        if first.count != second.count:
            what = f"has {second.count} bodies, {first.path} has {first.count}; expected the same people in both"
            raise FileError(second.path, what)
        return list(range(first.count)), list(range(second.count)), 0
    for one in (first, second):
        if len(set(one.names or ())) < one.count:
            raise FileError(one.path, f"names {one.count - len(set(one.names or ()))} bodies more than once")
    there = {name: row for row, name in enumerate(second.names)}
    rows = [row for row, name in enumerate(first.names) if name in there]
    if not rows:
        what = f"has no body of {first.path}: {second.names[0]!r} and so on there, {first.names[0]!r} here"
        raise FileError(second.path, what)
    return rows, [there[first.names[row]] for row in rows], first.count + second.count - 2 * len(rows)


def _rows(run: Simulation, rows: Sequence[int]) -> Simulation:
    columns = {field.name: getattr(run, field.name) for field in fields(run)}
    for_all = ("engine", "times")
    return Simulation(**{name: value if name in for_all else value[list(rows)] for name, value in columns.items()})


def comparison_record(comparison: MethodComparison, first: Fall, second: Fall) -> dict[str, Any]:
    """Plain values for JSON: metres, shares; null where there is no verdict or no interval."""

    def means(value: Means) -> dict[str, Any]:
        interval = {
            name: {"mean": pair.mean, "low": pair.low, "high": pair.high}
            for name, pair in (("difference", value.difference), ("ratio", value.ratio))
        }
        return {"first": value.first, "second": value.second, **interval}

    return jsonable(
        {
            "first": str(first.path),
            "second": str(second.path),
            "bodies": comparison.bodies,
            "left_out": comparison.left_out,
            "times": comparison.times,
            "stable": None if comparison.stable is None else means(comparison.stable),
            "displacement": [means(value) for value in comparison.displacement],
            "more_stable_percent": None if comparison.stable is None else _percent(comparison.stable.ratio),
            "more_stable_percent_in_the_paper": MORE_STABLE_IN_THE_PAPER,
            "interval": "95 %, paired bootstrap over bodies, 10,000 resamples",
        }
    )


def _percent(ratio: Interval) -> list[float]:
    return [100 * (value - 1) for value in ratio]


def comparison_table(comparison: MethodComparison) -> tuple[list[str], list[list[str]]]:
    """Head and lines."""
    head = ["", "A", "B", "A − B", "A / B"]
    if comparison.stable is None:
        lines = [[f"stable, %: no verdict before {VERDICT:g} s", *["–"] * 4]]
    else:
        lines = [[f"stable after {comparison.times[-1]:.3g} s, %", *_cells(comparison.stable, 100, 0, " points")]]
    for seconds, value in zip(comparison.times, comparison.displacement, strict=True):
        lines.append([f"moved in {seconds:.3g} s, mean, mm", *_cells(value, 1e3, 1, " mm")])
    return head, lines


def _cells(value: Means, factor: float, digits: int, unit: str) -> list[str]:
    means = [f"{factor * mean:.{digits}f}" for mean in (value.first, value.second)]
    difference = Interval(*(factor * number for number in value.difference))
    return [*means, _shown(difference, f"+.{digits}f", unit), _shown(value.ratio, ".2f")]


def _shown(interval: Interval, form: str, unit: str = "") -> str:
    mean, low, high = (format(value, form).replace("-", "−") if np.isfinite(value) else "–" for value in interval)
    return f"{mean}{unit}" if (low, high) == ("–", "–") else f"{mean} [{low}, {high}]{unit}"


def comparison_lines(comparison: MethodComparison, first: Fall, second: Fall) -> list[str]:
    """What stands under the table."""
    left_out = f", {comparison.left_out} left out: not in both, or not simulated" if comparison.left_out else ""
    lines = [
        f"A: {first.path}",
        f"B: {second.path}",
        f"{comparison.bodies} bodies in both{left_out}; 95 % intervals, paired bootstrap over bodies",
    ]
    known = comparison.stable is not None and np.isfinite(comparison.stable.ratio.mean)
    more = f"{_shown(Interval(*_percent(comparison.stable.ratio)), '+.1f')} %" if comparison.stable and known else "–"
    paper = f"+{MORE_STABLE_IN_THE_PAPER} % (IPMAN-O against SMPLify-XMC on MoYo: a small displacement in 100 steps)"
    return [*lines, f"how many more of A's bodies are stable than of B's: {more}; printed in the paper: {paper}"]


def write_comparison(one: Simulation, other: Simulation, paths: tuple[Path, Path], output: Path) -> None:
    """comparison.png and .svg: the share of bodies that moved less than so far, of A and of B, the files of these
    `paths`. Raises OSError."""
    import matplotlib
    from matplotlib.figure import Figure

    names = _told_apart(*paths)
    known = np.isfinite(one.displacement[:, -1]) & np.isfinite(other.displacement[:, -1])
    figure = Figure(figsize=(0.6 + 3.6 * len(one.times), 3.6), layout="constrained")  # inches
    axes = figure.subplots(1, len(one.times), squeeze=False, sharey=True)[0]
    for k, (axis, seconds) in enumerate(zip(axes, one.times, strict=True)):
        for run, name, color in ((one, f"A: {names[0]}", "#1f4e79"), (other, f"B: {names[1]}", "#c0504d")):
            moved = np.sort(1e3 * run.displacement[known, k])
            share = 100 * np.arange(len(moved) + 1) / len(moved)
            axis.step([0.0, *moved], share, where="post", color=color, label=name)
        axis.set_xscale("symlog", linthresh=1.0)
        axis.xaxis.set_major_formatter("{x:g}")
        axis.set_xlim(left=0.0)
        axis.set_ylim(0, 102)
        axis.set_xlabel(f"moved in {seconds:.3g} s, mm", fontsize=9)
        axis.tick_params(labelsize=8)
        axis.grid(alpha=0.3)
    axes[0].set_ylabel("% of bodies that moved less", fontsize=9)
    key = figure.legend(*axes[0].get_legend_handles_labels(), loc="outside lower left", fontsize=8, frameon=False)
    for text in key.get_texts():
        text.set_parse_math(False)
    fix_layout(figure, PNG_DPI)
    with matplotlib.rc_context({"svg.fonttype": "none", "svg.hashsalt": NAME}):
        with atomic_write(output / f"{NAME}.svg") as file:
            figure.savefig(file, format="svg", metadata={"Date": None})
        with atomic_write(output / f"{NAME}.png") as file:
            figure.savefig(file, format="png", dpi=PNG_DPI)


def _told_apart(first: Path, second: Path) -> tuple[str, str]:
    """The last parts of two paths, as many as it takes to tell them apart, at most the last 48 characters."""
    one, other = first.resolve().parts, second.resolve().parts
    least = 1
    while one[-least:] == other[-least:] and least < max(len(one), len(other)):
        least += 1
    names = ("/".join(parts[-least:]) for parts in (one, other))
    a, b = (name if len(name) <= LONGEST else f"…{name[1 - LONGEST :]}" for name in names)
    return a, b
