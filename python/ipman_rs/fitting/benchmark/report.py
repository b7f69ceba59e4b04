"""The tables of the benchmark: Markdown, JSON, CSV and a plot."""

from __future__ import annotations

import csv
import json
from collections.abc import Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Any

import jinja2
import numpy as np
from numpy.typing import NDArray

from ipman_rs.evaluation import Interval, paired
from ipman_rs.plain import plain

from . import scenes
from .measure import Figures
from .run import Benchmark, Block, Result
from .truth import Truth, floors

Array = NDArray[np.floating]
Found = Sequence[tuple[Block, Truth, Sequence[Result]]]

NAME = "fitting_benchmark"
# Title, what of the figures, digits: intervals are given of these.
DIFFERENCES = {"PVE": 1, "PVE world": 1, "BoSE 3 cm": 0}


def write(found: Found, run: Benchmark) -> Path:
    """The files into the folder of the run; the page's path."""
    record = {"run": {**asdict(run), "folder": None}, "blocks": [_record(*block) for block in found]}
    (run.folder / f"{NAME}.json").write_text(json.dumps(plain(record), indent=1, allow_nan=False) + "\n")
    _write_csv(found, run.folder / f"{NAME}.csv")
    _plot(record["blocks"], run.folder / f"{NAME}.svg")
    environment = jinja2.Environment(
        loader=jinja2.FileSystemLoader(Path(__file__).parent), trim_blocks=True, lstrip_blocks=True,
        keep_trailing_newline=True,
    )  # fmt: skip
    environment.filters |= {"interval": _interval, "mean_of": lambda interval: interval[0]}
    page = run.folder / f"{NAME}.md"
    text = environment.get_template(f"{NAME}.md.j2").render(
        record, verdicts=verdicts(record["blocks"]), floors=floors(found[0][1]), families=scenes.FAMILIES,
        digits=DIFFERENCES,
    )  # fmt: skip
    page.write_text(text)
    return page


def columns(figures: Figures, baseline: Figures) -> dict[str, Array]:
    """The figures as tables show them, an entry a body: millimetres, and shares as 0 or 100 %."""
    return {
        "MPJPE": 1e3 * figures.mpjpe,
        "PA-MPJPE": 1e3 * figures.pa_mpjpe,
        "PVE": 1e3 * figures.pve,
        "PVE world": 1e3 * figures.pve_world,
        "BoSE 10 cm": 100.0 * (figures.margin_10 >= 0),
        "BoSE 3 cm": 100.0 * (figures.margin_3 >= 0),
        "penetration": 1e3 * (-figures.lowest).clip(min=0),
        "hover": 1e3 * figures.lowest.clip(min=0),
        "height bias": 100.0 * (figures.size - 1),
        "worse": 100.0 * (figures.pve > baseline.pve),
        "converged": 100.0 * figures.converged,
    }


def _record(block: Block, truth: Truth, results: Sequence[Result]) -> dict[str, Any]:
    """Means and intervals, whole and by family."""
    families = list(dict.fromkeys(truth.family.tolist()))
    by_name = {result.row.name: columns(result.figures, results[0].figures) for result in results}
    baseline, bare = by_name[results[0].row.name], by_name["ours without physics"]
    rows = []
    for result in results:
        name = result.row.name
        own = by_name[name]
        rows.append(
            {
                "name": name,
                "preset": result.row.preset,
                "without": list(result.row.without),
                "seconds": result.seconds,
                "mean": {key: float(value.mean()) for key, value in own.items()},
                "median PVE": float(np.median(own["PVE"])),
                "against baseline": _differences(own, baseline),
                "against ours without physics": _differences(own, bare),
                "families": {
                    family: {key: float(own[key][truth.family == family].mean()) for key in DIFFERENCES}
                    | {
                        "difference": paired(
                            own["PVE"][truth.family == family], baseline["PVE"][truth.family == family]
                        )
                    }
                    for family in families
                },
            }
        )
    true = {f"BoSE {cm} cm": float(100 * (margin >= 0).mean()) for cm, margin in _margins(truth).items()}
    true_of = {family: float(100 * (truth.margin_3[truth.family == family] >= 0).mean()) for family in families}
    return {
        "name": block.name,
        "kind": block.kind,
        "told": block.told,
        "bodies": len(truth),
        "truth": {**true, "families": true_of},
        "rows": rows,
    }


def _margins(truth: Truth) -> dict[int, Array]:
    return {10: truth.margin_10, 3: truth.margin_3}


def _differences(own: dict[str, Array], other: dict[str, Array]) -> dict[str, Interval]:
    return {key: paired(own[key], other[key]) for key in DIFFERENCES}


def verdicts(blocks: Sequence[dict[str, Any]]) -> list[tuple[str, bool, str]]:
    """What was to be shown: the claim, whether the intervals say so, and the numbers."""
    judged = []
    for block in blocks:
        rows = {row["name"]: row for row in block["rows"]}
        if block["kind"] != "balanced":
            for other in ("baseline", "ours without physics"):
                pve = rows["ours"][f"against {other}"]["PVE"]
                judged.append((f"{block['name']}: ours no worse than {other}", pve[1] <= 0, f"PVE {_interval(pve)} mm"))
            continue
        row = "both" if not isinstance(block["told"], float) else "ours"
        pve, bose = (rows[row]["against baseline"][key] for key in ("PVE", "BoSE 3 cm"))
        said = f"PVE {_interval(pve)} mm, BoSE 3 cm {_interval(bose, 0)} points"
        if not isinstance(block["told"], float):
            judged.append((f"{block['name']}: both terms better", pve[2] < 0 and bose[1] > 0, said))
        else:
            judged.append((f"{block['name']}: ours more balanced, PVE no worse", pve[1] <= 0 and bose[1] > 0, said))
    return judged


def _interval(interval: Sequence[float], digits: int = 1) -> str:
    """A family of one body has no interval."""
    mean, *ends = (f"{value:+.{digits}f}".replace("-", "−") for value in interval if not np.isnan(value))
    return f"{mean} [{', '.join(ends)}]" if ends else mean


def _write_csv(found: Found, path: Path) -> None:
    """A line a body and row."""
    with path.open("w", newline="") as file:
        lines = csv.writer(file)
        head: list[str] | None = None
        for block, truth, results in found:
            for result in results:
                numbers = columns(result.figures, results[0].figures)
                if head is None:
                    head = list(numbers)
                    lines.writerow(["block", "row", "body", "family", *head])
                for body, family in enumerate(truth.family.tolist()):
                    values = [f"{numbers[key][body]:.3f}" for key in head]
                    lines.writerow([block.name, result.row.name, body, family, *values])


def _plot(blocks: Sequence[dict[str, Any]], path: Path) -> None:
    """Differences against the baseline with their intervals."""
    import matplotlib
    from matplotlib.figure import Figure

    figure = Figure(figsize=(11, 1 + 1.6 * len(blocks)), layout="constrained")
    axes = figure.subplots(len(blocks), len(DIFFERENCES), squeeze=False, sharex="col")
    for block, line in zip(blocks, axes, strict=True):
        rows = block["rows"][1:]
        for key, axis in zip(DIFFERENCES, line, strict=True):
            values = np.array([row["against baseline"][key] for row in rows])
            places = -np.arange(len(rows))
            reach = np.abs(values[:, 1:] - values[:, :1]).T
            axis.errorbar(values[:, 0], places, xerr=reach, fmt="o", markersize=4, capsize=3, color="#1f4e79")
            axis.axvline(0, color="#999999", linewidth=0.8)
            axis.set_yticks(places, [row["name"] for row in rows] if key == "PVE" else [])
            axis.tick_params(labelsize=8)
        line[0].set_title(f"{block['name']} (n = {block['bodies']})", loc="left", fontsize=9, fontweight="bold")
    for key, axis in zip(DIFFERENCES, axes[-1], strict=True):
        unit = "points" if "BoSE" in key else "mm"
        axis.set_xlabel(f"{key} against the baseline, {unit}", fontsize=9)
    with matplotlib.rc_context({"svg.fonttype": "none", "svg.hashsalt": NAME}):
        figure.savefig(path, metadata={"Date": None})
