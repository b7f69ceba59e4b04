"""The tables of the benchmark: Markdown, JSON, CSV and a plot."""

from __future__ import annotations

import csv
import io
import json
from collections.abc import Mapping, Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ipman_rs.files import atomic_write, write_whole
from ipman_rs.files.page_templates import environment

from ...training.metrics import COLUMNS, PoseMetrics, columns
from .claims import UNITS, judge_claims
from .intervals import paired_over_seeds
from .run import TILTS, TrainingBenchmark, TrainingVariantResult
from .variants import BASELINE, CONTROL, OURS

Array = NDArray[np.floating]
ResultsByTilt = Mapping[float, Sequence[TrainingVariantResult]]

PAGES = {"keypoints": "training_benchmark", "images": "training_benchmark_images"}
TEMPLATE = "training_benchmark.md.j2"
# Of these, intervals are given: digits.
DIFFERENCES = {"PVE": 1, "BoSE": 1, "strict BoSE (exact CoM)": 1, "tilt": 2, "penetration": 1, "hover": 1}
ASKED = 8.0  # degrees: the tilt at which something was to be shown


def write(results_by_tilt: ResultsByTilt, run: TrainingBenchmark) -> Path:
    """The files into the folder of the run; the page's path."""
    name = PAGES[run.task.name]
    record = {
        "run": {
            "seeds": run.seeds,
            "part": run.part,
            "lean": run.lean,
            **run.task.trained_on(),
            **run.task.tested_on(),
        },
        "plan": asdict(run.plan),
        "rows": [asdict(row) for row in run.rows],
        "blocks": [_record(tilt, results) for tilt, results in results_by_tilt.items()],
    }
    write_whole(run.folder / f"{name}.json", json.dumps(record, indent=1, allow_nan=False) + "\n")
    _write_csv(results_by_tilt, run.folder / f"{name}.csv")
    _plot(record["blocks"], run.folder / f"{name}.svg")
    path = run.folder / f"{name}.md"
    write_whole(path, page(record))
    return path


def page(record: dict[str, Any]) -> str:
    """The Markdown of a record, as `write` leaves it in the JSON."""
    pages = environment(Path(__file__).parent, interval=_interval, signed=_signed)
    task = record["run"]["name"]
    tilts = tuple(block["tilt"] for block in record["blocks"])
    return pages.get_template(TEMPLATE).render(
        record, name=PAGES[task], tilts="" if tilts == TILTS[task] else "".join(f" --tilt {tilt:g}" for tilt in tilts),
        verdicts=verdicts(record["blocks"]), claims=judge_claims(record["blocks"]), units=UNITS, columns=COLUMNS,
        differences=DIFFERENCES,
    )  # fmt: skip


def _record(tilt: float, results: Sequence[TrainingVariantResult]) -> dict[str, Any]:
    """Means and intervals of the labels of one tilt."""
    tables = {result.row.name: _stacked(result.figures) for result in results}
    baseline = tables[BASELINE]
    rows = []
    for result in results:
        own = tables[result.row.name]
        rows.append(
            {
                "name": result.row.name,
                "mean": {key: float(own[key].mean()) for key in COLUMNS},
                "against baseline": {key: paired_over_seeds(own[key], baseline[key]) for key in DIFFERENCES},
                "seeds": {key: (own[key] - baseline[key]).mean(axis=1).tolist() for key in ("PVE", "BoSE")},
            }
        )
    return {"tilt": tilt, "bodies": len(results[0].figures[0].pve), "rows": rows}


def _stacked(figures: Sequence[PoseMetrics]) -> dict[str, Array]:
    """{column: (seeds, bodies)}."""
    of_seeds = [columns(one) for one in figures]
    return {key: np.stack([one[key] for one in of_seeds]) for key in COLUMNS}


def verdicts(blocks: Sequence[dict[str, Any]]) -> list[tuple[str, bool, str]]:
    """What was to be shown of our own preset: the claim, whether the figures say so, and the numbers."""
    lines = []
    for block in blocks:
        rows = {row["name"]: row for row in block["rows"]}
        ours, control, baseline = rows[OURS], rows[CONTROL], rows[BASELINE]
        difference, seeds = ours["against baseline"], ours["seeds"]
        pve, bose = difference["PVE"], difference["BoSE"]
        if block["tilt"] == 0:
            share = 100 * pve[0] / baseline["mean"]["PVE"]
            lines.append(("clean labels: PVE within +2 %", share <= 2, f"{share:+.1f} % ({_interval(pve)} mm)"))
            for key in ("hover", "penetration"):
                lines.append(
                    (f"clean labels: {key} no worse", difference[key][1] <= 0, f"{_interval(difference[key])} mm")
                )
        elif block["tilt"] == ASKED:
            title = f"labels that lean by {ASKED:g}°"
            each = ", ".join(_signed(value, 2) for value in seeds["BoSE"])  # 3.98 is not 4.0 here
            lines.append((f"{title}: BoSE 4 points up in every seed", min(seeds["BoSE"]) >= 4, each))
            lines.append((f"{title}: PVE not above HMR*'s", pve[0] <= 0, f"{_interval(pve)} mm"))
            for key, gain, unit in (("PVE", pve, "mm"), ("BoSE", bose, "points")):
                lost = control["against baseline"][key]
                gone = lost[2] >= 0 if key == "PVE" else lost[1] <= 0
                numbers = f"{_interval(lost)}, not {_interval(gain)} {unit}"
                lines.append((f"{title}: the gain in {key} is lost with a shuffled camera", gone, numbers))
    return lines


def _interval(interval: Sequence[float], digits: int = 1) -> str:
    mean, low, high = (_signed(value, digits) for value in interval)
    return f"{mean} [{low}, {high}]"


def _signed(value: float, digits: int = 1) -> str:
    return f"{value:+.{digits}f}".replace("-", "−")


def _write_csv(results_by_tilt: ResultsByTilt, path: Path) -> None:
    """One line per body, row and seed."""
    file = io.StringIO(newline="")
    lines = csv.writer(file)
    lines.writerow(["labels", "row", "seed", "body", *COLUMNS])
    for tilt, results in results_by_tilt.items():
        for result in results:
            for seed, figures in enumerate(result.figures):
                numbers = columns(figures)
                for body in range(len(figures.pve)):
                    values = [f"{numbers[key][body]:.3f}" for key in COLUMNS]
                    lines.writerow([f"{tilt:g}", result.row.name, seed, body, *values])
    write_whole(path, file.getvalue())


def _plot(blocks: Sequence[dict[str, Any]], path: Path) -> None:
    """Differences from HMR* with their intervals, over the tilt of the labels."""
    import matplotlib
    from matplotlib.figure import Figure

    shown = [row["name"] for row in blocks[0]["rows"] if row["name"] != BASELINE]
    keys = ("PVE", "BoSE", "strict BoSE (exact CoM)")
    figure = Figure(figsize=(12, 5), layout="constrained")
    axes = figure.subplots(1, len(keys), sharex=True)
    for key, axis in zip(keys, axes, strict=True):
        for number, name in enumerate(shown):
            values = np.array([_row(block, name)["against baseline"][key] for block in blocks])
            tilts = np.array([block["tilt"] for block in blocks]) + 0.12 * (number - len(shown) / 2)
            reach = np.abs(values[:, 1:] - values[:, :1]).T
            width = 2.0 if name == OURS else 0.8
            axis.errorbar(
                tilts, values[:, 0], yerr=reach, fmt="o-", markersize=3, capsize=2, linewidth=width, label=name
            )
        axis.axhline(0, color="#999999", linewidth=0.8)
        axis.set_xlabel("tilt of the labels, degrees", fontsize=9)
        axis.set_title(f"{key} against HMR*, {'mm' if key == 'PVE' else 'points'}", fontsize=9)
        axis.tick_params(labelsize=8)
    figure.legend(*axes[0].get_legend_handles_labels(), loc="outside lower center", ncols=5, fontsize=8)
    fonts = matplotlib.rc_context({"svg.fonttype": "none", "svg.hashsalt": "training_benchmark"})
    with fonts, atomic_write(path) as file:
        figure.savefig(file, format="svg", metadata={"Date": None})


def _row(block: dict[str, Any], name: str) -> dict[str, Any]:
    return next(row for row in block["rows"] if row["name"] == name)
