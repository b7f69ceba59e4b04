"""The files of an evaluation: evaluation.md, .json, .csv, .svg, .png, sequences.csv and frames.parquet."""

from __future__ import annotations

import csv
import io
import json
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from ipman_rs import __version__
from ipman_rs.files import atomic_write, cell, write_whole
from ipman_rs.files.page_templates import environment

from ..statistics.bootstrap import Interval
from . import parquet
from .job import Job
from .joints import COUNTED, Definition
from .metrics import METRICS, Metric
from .paper import Table
from .summary import EDGES, Difference, MethodSummary, pieces_by_method

NAME = "evaluation"


@dataclass(frozen=True)
class Report:
    """Everything that the files show."""

    title: str
    data: str
    measured: Sequence[MethodSummary]
    differences: Sequence[Difference]
    table: Table | None = None
    definitions: Mapping[str, Definition | None] = field(default_factory=dict)  # which joints are compared, by method
    flags: Mapping[str, Sequence[str]] = field(default_factory=dict)  # what is unusual, by method

    @property
    def joints(self) -> list[str]:
        """Which joints were compared, one line per definition, and a note if they are not the paper's."""
        methods: dict[str, list[str]] = {}
        for name, definition in self.definitions.items():
            if definition is not None:
                methods.setdefault(definition.words, []).append(name)
        lines = [f"{', '.join(names)}: {words}." for words, names in methods.items()]
        makers = {each.estimate for each in self.definitions.values() if each is not None}
        if self.table is not None and self.table.regressor and makers & {"own", "extra"}:
            lines.append(f"The paper compares {len(COUNTED)} other joints: give `regressors=J_regressor_h36m.npy`.")
        return lines

    @property
    def metrics(self) -> dict[str, Metric]:
        """The metrics of the table, or all that some method has."""
        available = {name for each in self.measured for name in each.summary}
        wanted = [name for name in METRICS if name in available] if self.table is None else self.table.metrics
        return {name: METRICS[name] for name in wanted}


def write(report: Report, folder: Path, jobs: list[Job], progress: Callable[[int], None]) -> list[Path]:
    """Writes the files and returns their paths; `progress(frames)` is called as frames.parquet grows."""
    files = {**{name: text.encode() for name, text in texts(report).items()}, **_plot(report)}
    for name, content in files.items():
        write_whole(folder / name, content)
    written = [folder / name for name in files]
    return [*written, *write_frames(folder / "frames.parquet", report, jobs, progress)]


def texts(report: Report) -> dict[str, str]:
    """The content of the text files, by name."""
    return {
        f"{NAME}.md": markdown(report),
        f"{NAME}.json": json.dumps(record(report), indent=1, allow_nan=False) + "\n",
        f"{NAME}.csv": _csv(report),
        "sequences.csv": _sequences(report),
    }


def markdown(report: Report) -> str:
    return environment(Path(__file__).parent).get_template(f"{NAME}.md.j2").render(
        report=report, figures=report.metrics, table=rows(report), missing=_missing(report), version=__version__,
        shown=shown, interval=_interval, verdict=_verdict,
    )  # fmt: skip


def shown(figure: Metric, value: float | None) -> str:
    """A number in the metric's unit; a dash if it is not finite."""
    if value is None or not np.isfinite(value):
        return "–"
    return f"{value * figure.factor:.{figure.digits}f}".replace("-", "−")


def rows(report: Report) -> tuple[list[str], list[list[str]]]:
    """Head and lines of the table, printed values before the measured ones."""
    figures = report.metrics
    columns: list[tuple[str, dict[str, str]]] = []
    for method, printed in (report.table.published if report.table else {}).items():
        cells = {name: f"{value:.{METRICS[name].digits}f}" for name, value in printed.items()}
        columns.append((f"{method} (printed)", cells))
    for each in report.measured:
        values = {}
        for name, figure in figures.items():
            mean_interval = each.intervals.get(name)
            values[name] = "–" if mean_interval is None else _with_interval(figure, mean_interval)
        columns.append((each.name, values))
    titles = {name: f"{figure.title}{f', {figure.unit}' if figure.unit else ''}" for name, figure in figures.items()}
    if report.table is None or report.table.across:
        head = ["", *(name for name, _ in columns)]
        return head, [[titles[key], *(values.get(key, "–") for _, values in columns)] for key in figures]
    return ["", *titles.values()], [[name, *(values.get(key, "–") for key in figures)] for name, values in columns]


def _with_interval(figure: Metric, interval: Interval) -> str:
    if not np.isfinite(interval.low):
        return shown(figure, interval.mean)
    return f"{shown(figure, interval.mean)} [{shown(figure, interval.low)}, {shown(figure, interval.high)}]"


def _interval(figure: Metric, interval: Interval) -> str:
    mean, low, high = (
        f"{value * figure.factor:+.{figure.digits}f}".replace("-", "−") if np.isfinite(value) else "–"
        for value in interval
    )
    return f"{mean} [{low}, {high}]"


def _verdict(figure: Metric, interval: Interval) -> str:
    if not interval.excludes_zero or not figure.better:
        return "no difference shown" if not interval.excludes_zero else "differs"
    return "better" if interval.mean * figure.better > 0 else "worse"


def _missing(report: Report) -> list[str]:
    """What is missing, and why: one line for all metrics of a method that lack the same frames."""
    groups: dict[tuple[str, str], list[str]] = {}
    for each in report.measured:
        for name, summary in each.summary.items():
            why = ", ".join(f"{count:,} {reason}" for reason, count in sorted(summary.missing.items()))
            if why and name in report.metrics:
                groups.setdefault(
                    (f"{each.name}: {sum(summary.missing.values()):,} of {each.frames:,}", why), []
                ).append(name)
    lacking: dict[str, list[str]] = {}
    for name, figure in report.metrics.items():
        if not any(name in each.summary for each in report.measured):
            lacking.setdefault(figure.needs, []).append(figure.title)
    return [f"{', '.join(titles)}: not to be had without {needs}" for needs, titles in lacking.items()] + [
        f"{frames} frames have no {', '.join(METRICS[name].title for name in names)}: {why}"
        for (frames, why), names in groups.items()
    ]


def record(report: Report) -> dict[str, Any]:
    """Everything as plain values in metres, radians and shares; None for values that are not finite."""

    def plain(value: float) -> float | None:
        return float(value) if np.isfinite(value) else None

    return {
        "version": __version__,
        "title": report.title,
        "data": report.data,
        "joints": {
            name: None if each is None else {**asdict(each), "names": list(each.names), "roots": list(each.roots)}
            for name, each in report.definitions.items()
        },
        "units": {name: "shown in " + (f.unit or "1") + f", times {f.factor:g}" for name, f in METRICS.items()},
        "printed": {} if report.table is None else {k: dict(v) for k, v in report.table.published.items()},
        "edges": EDGES.tolist(),
        "methods": {
            each.name: {
                "frames": each.frames,
                "flags": list(report.flags.get(each.name, ())),
                "figures": {
                    name: {
                        **{key: plain(getattr(each.summary[name], key)) for key in ("mean", "std", "least", "largest")},
                        "interval": [plain(each.intervals[name].low), plain(each.intervals[name].high)],
                        "frames": each.summary[name].frames,
                        "sequences": len(each.clusters[name].names),
                        "missing": dict(each.summary[name].missing),
                    }
                    for name in each.summary
                },
                "frames below": {name: counts.tolist() for name, counts in each.below.items()},
            }
            for each in report.measured
        },
        "differences": [
            {
                "method": each.name,
                "baseline": each.baseline,
                "figures": {
                    name: {
                        "mean": plain(interval.mean),
                        "interval": [plain(interval.low), plain(interval.high)],
                        "p": each.p.get(name),
                        "frames": each.frames[name],
                    }
                    for name, interval in each.intervals.items()
                },
            }
            for each in report.differences
        ],
    }


def _csv(report: Report) -> str:
    """One line per method and metric, in the units of the table."""
    text = io.StringIO()
    lines = csv.writer(text, lineterminator="\n")
    lines.writerow(["method", "figure", "unit", "mean", "low", "high", "std", "frames", "sequences", "without"])
    for method, printed in (report.table.published if report.table else {}).items():
        for name, value in printed.items():
            lines.writerow([cell(f"{method} (printed)"), METRICS[name].title, METRICS[name].unit, value, *[""] * 6])
    for each in report.measured:
        for name, summary in each.summary.items():
            figure, interval = METRICS[name], each.intervals[name]
            numbers = [value * figure.factor for value in (summary.mean, interval.low, interval.high, summary.std)]
            cells = [repr(float(value)) if np.isfinite(value) else "" for value in numbers]
            counts = [summary.frames, len(each.clusters[name].names), sum(summary.missing.values())]
            lines.writerow([cell(each.name), figure.title, figure.unit, *cells, *counts])
    for each in report.differences:
        for name, interval in each.intervals.items():
            figure = METRICS[name]
            cells = [
                repr(float(v * figure.factor)) if np.isfinite(v) else ""
                for v in (interval.mean, interval.low, interval.high)
            ]
            label = cell(f"{each.name} − {each.baseline}")
            lines.writerow([label, figure.title, figure.unit, *cells, "", each.frames[name], "", ""])
    return text.getvalue()


def _sequences(report: Report) -> str:
    """One line per method, sequence and metric; methods with too many sequences to keep apart are left out."""
    text = io.StringIO()
    lines = csv.writer(text, lineterminator="\n")
    lines.writerow(["method", "sequence", "figure", "unit", "mean", "frames"])
    for each in report.measured:
        for name, clusters in each.clusters.items() if not each.pooled else ():
            figure = METRICS[name]
            for sequence, total, count in zip(clusters.names, clusters.sums, clusters.counts, strict=True):
                mean = repr(float(total / count * figure.factor))
                lines.writerow([cell(each.name), cell(str(sequence)), figure.title, figure.unit, mean, int(count)])
    return text.getvalue()


def _plot(report: Report) -> dict[str, bytes]:
    """Shares of frames below an error, one panel per metric, and the differences with their intervals."""
    import matplotlib
    from matplotlib.figure import Figure

    distributions = [name for name in report.metrics if any(name in each.below for each in report.measured)]
    panels = max(1, len(distributions) + len(report.differences))
    wide = min(3, panels)
    high = -(-panels // wide)
    picture = Figure(figsize=(4.2 * wide, 3.2 * high), layout="constrained")
    axes = picture.subplots(high, wide, squeeze=False).ravel()
    for axis, name in zip(axes, distributions, strict=False):
        _shares(axis, name, [each for each in report.measured if name in each.below and each.summary[name].frames])
    if distributions and len(report.measured) > 1:
        axes[0].legend(fontsize=8)
    for axis, each in zip(axes[len(distributions) :], report.differences, strict=False):
        means = {name: interval.mean for name, interval in report.measured[0].intervals.items()}
        _differences(axis, each, {name: means[name] for name in report.metrics if name in each.intervals})
    for axis in axes[len(distributions) + len(report.differences) :]:
        axis.set_axis_off()
    svg, png = io.BytesIO(), io.BytesIO()
    with matplotlib.rc_context({"svg.fonttype": "none", "svg.hashsalt": NAME}):
        picture.savefig(svg, format="svg", metadata={"Date": None})
        picture.savefig(png, format="png", dpi=130)
    return {f"{NAME}.svg": svg.getvalue(), f"{NAME}.png": png.getvalue()}


def _shares(axis: Any, name: str, methods: Sequence[MethodSummary]) -> None:
    """Cumulative distributions of a metric, up to where they reach 99 %."""
    figure, end = METRICS[name], 1
    for each in methods:
        share = 100 * each.below[name] / each.summary[name].frames
        axis.plot(EDGES * figure.factor, share, label=each.name)
        end = max(end, int(np.searchsorted(share, 99.0)))
    axis.set_xlim(0, EDGES[min(end, len(EDGES) - 1)] * figure.factor)
    axis.set_xlabel(f"{figure.title}, {figure.unit}", fontsize=9)
    axis.set_ylabel("% of frames below", fontsize=9)
    axis.tick_params(labelsize=8)
    axis.grid(alpha=0.3)


def _differences(axis: Any, difference: Difference, means: Mapping[str, float]) -> None:
    """Differences in % of the baseline's means, so that metrics of different units share an axis."""
    drawn = [name for name, mean in means.items() if mean and np.isfinite(difference.intervals[name].low)]
    for place, name in enumerate(drawn):
        interval = difference.intervals[name]
        color = {"better": "#2e7d32", "worse": "#c62828"}.get(_verdict(METRICS[name], interval), "#777777")
        mean, low, high = (100 * value / means[name] for value in interval)
        axis.errorbar(mean, -place, xerr=[[mean - low], [high - mean]], fmt="o", markersize=4, capsize=3, color=color)
    axis.axvline(0, color="#999999", linewidth=0.8)
    axis.set_yticks([-place for place in range(len(drawn))], [METRICS[name].title for name in drawn])
    axis.set_title(f"{difference.name} − {difference.baseline} (green: better)", fontsize=9)
    axis.set_xlabel(f"% of {difference.baseline}'s mean", fontsize=9)
    axis.tick_params(labelsize=8)


def write_frames(path: Path, report: Report, jobs: list[Job], progress: Callable[[int], None]) -> list[Path]:
    """Writes the metrics of every frame, method by method; nothing without pyarrow."""
    try:
        pyarrow, writer = parquet.require_pyarrow()
    except ValueError:
        return []
    names = [name for name in METRICS if any(name in each.summary for each in report.measured)]
    text = ["method", "name", "sequence"]
    schema = pyarrow.schema([(name, pyarrow.string()) for name in text] + [(name, pyarrow.float64()) for name in names])
    with atomic_write(path) as file, writer.ParquetWriter(file, schema, compression="zstd") as table:
        for method, piece in pieces_by_method(jobs):
            count = len(piece["names"])
            columns = {"method": [method] * count, "name": piece["names"], "sequence": piece["sequences"]}
            # Null instead of NaN, because queries leave nulls out of means.
            numbers = {name: piece.get(name, np.full(count, np.nan)) for name in names}
            columns |= {name: pyarrow.array(value, from_pandas=True) for name, value in numbers.items()}
            table.write_table(pyarrow.table(columns, schema=schema))
            progress(count)
    return [path]
