"""The tables of the benchmark: Markdown, JSON, CSV and a plot."""

from __future__ import annotations

import csv
import io
import json
from collections.abc import Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ipman_rs.evaluation import Interval, paired
from ipman_rs.files import atomic_write, read_json, write_whole
from ipman_rs.files.page_templates import environment
from ipman_rs.jsonable import jsonable

from ...synthetic import at_rest
from .metrics import FitMetrics
from .run import Block, FittingBenchmark, FittingVariantResult
from .truth import Truth, error_floors

Array = NDArray[np.floating]
BlockResults = Sequence[tuple[Block, Truth, Sequence[FittingVariantResult]]]

NAME = "fitting_benchmark"
# Differences of these have intervals, with so many digits; the tables and the plot show the second line's.
COMPARED = {"MPJPE": 1, "PA-MPJPE": 1, "PVE": 1, "PVE world": 1, "BoSE 10 cm": 0, "BoSE 3 cm": 0}
DIFFERENCES = {"PVE": 1, "PVE world": 1, "BoSE 3 cm": 0}
# What the paper prints, by preset and row: its baseline's figure and the row's. IPMAN-O: Table 2 (MoYo); IPMAN-O*: the
# supplement's table on RICH.
PRINTED: dict[str, dict[str, dict[str, tuple[float, float]]]] = {
    "ipman-o-star": {
        "both": {"MPJPE": (268.6, 240.9), "PVE": (228.3, 217.1), "BoSE 10 cm": (96.9, 98.0)},
    },
    "ipman-o": {
        "+ ground": {
            "MPJPE": (75.3, 73.3), "PA-MPJPE": (36.5, 36.2), "PVE": (16.8, 14.5), "BoSE 10 cm": (98.0, 98.2),
        },
        "+ stability": {
            "MPJPE": (75.3, 88.5), "PA-MPJPE": (36.5, 38.6), "PVE": (16.8, 15.3), "BoSE 10 cm": (98.0, 97.8),
        },
        "both": {
            "MPJPE": (75.3, 71.9), "PA-MPJPE": (36.5, 34.3), "PVE": (16.8, 11.4), "BoSE 10 cm": (98.0, 98.6),
        },
    },
}  # fmt: skip
CLAIMED = ("MPJPE", "PA-MPJPE", "PVE", "BoSE 10 cm", "BoSE 3 cm")  # columns of the table of claims
PAPERS_FOUR = ("baseline", "+ ground", "+ stability", "both")


def write(blocks: BlockResults, run: FittingBenchmark) -> Path:
    """The files into the folder of the run; the page's path."""
    record = jsonable(
        {
            "run": {**asdict(run), "folder": None},
            "floors": error_floors(blocks[0][1]),
            "blocks": [_record(*block) for block in blocks],
        }
    )
    write_whole(run.folder / f"{NAME}.json", json.dumps(record, indent=1, allow_nan=False) + "\n")
    _write_csv(blocks, run.folder / f"{NAME}.csv")
    return render(run.folder)


def render(folder: Path) -> Path:
    """The page and the plot of the JSON that is in the folder; the page's path."""
    record = read_json(folder / f"{NAME}.json")
    _plot(record["blocks"], folder / f"{NAME}.svg")
    path = folder / f"{NAME}.md"
    write_whole(path, page(record))
    return path


def page(record: dict[str, Any]) -> str:
    """The Markdown of a record, as `write` leaves it in the JSON."""
    pages = environment(Path(__file__).parent, interval=_interval, mean_of=lambda interval: interval[0])
    return pages.get_template(f"{NAME}.md.j2").render(
        record, verdicts=verdicts(record["blocks"]), claims=claims(record["blocks"]), claimed=CLAIMED,
        families=at_rest.FAMILIES, digits=DIFFERENCES,
    )  # fmt: skip


def columns(figures: FitMetrics, baseline: FitMetrics) -> dict[str, Array]:
    """The metrics in the units of the tables, one entry per body: millimetres, and shares as 0 or 100 %."""
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


def _record(block: Block, truth: Truth, results: Sequence[FittingVariantResult]) -> dict[str, Any]:
    """Means and intervals, whole and by family."""
    families = list(dict.fromkeys(truth.family.tolist()))
    by_name = {result.row.name: columns(result.figures, results[0].figures) for result in results}
    baseline, bare = by_name[results[0].row.name], by_name["ours without physics"]
    published = by_name.get("as published")
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
                **({} if published is None else {"against as published": _differences(own, published)}),
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
    return {key: paired(own[key], other[key]) for key in COMPARED}


def verdicts(blocks: Sequence[dict[str, Any]]) -> list[tuple[str, bool, str]]:
    """What was to be shown of this project's presets: the claim, whether the intervals say so, and the numbers."""
    lines = []
    for block in blocks:
        rows = {row["name"]: row for row in block["rows"]}
        if block["kind"] != "balanced":
            for other in ("baseline", "ours without physics"):
                pve = rows["ours"][f"against {other}"]["PVE"]
                claim = f"{block['name']}: ours no worse than {other}"
                lines.append((claim, _direction(pve) in (-1, 0), f"PVE {_interval(pve)} mm"))
            continue
        row = "both" if not isinstance(block["told"], float) else "ours"
        pve, bose = (rows[row]["against baseline"][key] for key in ("PVE", "BoSE 3 cm"))
        numbers = f"PVE {_interval(pve)} mm, BoSE 3 cm {_interval(bose, 0)} points"
        balanced = _direction(bose) == 1
        if not isinstance(block["told"], float):
            lines.append((f"{block['name']}: both terms better", _direction(pve) == -1 and balanced, numbers))
        else:
            lines.append(
                (f"{block['name']}: ours more balanced, PVE no worse", _direction(pve) in (-1, 0) and balanced, numbers)
            )
    return lines


def claims(blocks: Sequence[dict[str, Any]]) -> list[tuple[str, str, str, list[str]]]:
    """What the paper says of its own terms, and whether it is so here: a line for each row of its tables.

    It has the block, the row, the changes that the paper prints, and a cell for each figure of CLAIMED.
    """
    lines = []
    for block in blocks:
        rows = {row["name"]: row for row in block["rows"]}
        if block["kind"] != "balanced":
            continue
        printed = PRINTED[rows["both"]["preset"]]
        for name, changes in printed.items():
            differences = ", ".join(f"{_number(own - baseline, 1)}" for baseline, own in changes.values())
            cells = [_claim(_signed(changes, key), _against(rows[name], rows["baseline"], key), key) for key in CLAIMED]
            lines.append((block["name"], f"{name} against the baseline", differences, cells))
        if "as published" in rows:
            both = printed["both"]
            cells = [
                _claim(_signed(both, key), _against(rows["both"], rows["as published"], key), key) for key in CLAIMED
            ]
            lines.append((block["name"], f"both against `{rows['as published']['preset']}` as published", "–", cells))
        if len(printed) > 1:
            cells = [_best(rows, key) for key in CLAIMED]
            lines.append((block["name"], "both the best of the four, by their means", "–", cells))
    return lines


def _signed(changes: dict[str, tuple[float, float]], key: str) -> int:
    """Which way the paper's figure went, 0 where it has none. It prints BoSE at 10 cm alone."""
    pair = changes.get("BoSE 10 cm" if key == "BoSE 3 cm" else key)
    return 0 if pair is None else int(np.sign(pair[1] - pair[0]))


def _against(row: dict[str, Any], other: dict[str, Any], key: str) -> Sequence[float | None]:
    """The difference with its interval, or without where the record has none."""
    interval = row.get(f"against {other['name']}", {}).get(key)
    return interval or [row["mean"][key] - other["mean"][key], None, None]


def _claim(sign: int, interval: Sequence[float | None], key: str) -> str:
    """The paper's word for its change, whether it is so here, and by how much."""
    numbers = _interval(interval, COMPARED[key])
    if sign == 0:
        return numbers
    word = "better" if (sign > 0) == key.startswith("BoSE") else "worse"
    answer = {sign: "**yes**", -sign: "no", 0: "not shown", None: "–"}[_direction(interval)]
    return f"{word}? {answer}, {numbers}"


def _best(rows: dict[str, dict[str, Any]], key: str) -> str:
    means = {name: rows[name]["mean"][key] for name in PAPERS_FOUR}
    best = (max if key.startswith("BoSE") else min)(means, key=lambda name: means[name])
    return "**yes**" if best == "both" else f"no, {best}"


def _direction(interval: Sequence[float | None]) -> int | None:
    """−1 or 1 where the interval lies on that side of 0, 0 where it has both, None where there is none."""
    _, low, high = interval
    if low is None or high is None:
        return None
    return 1 if low > 0 else -1 if high < 0 else 0


def _interval(interval: Sequence[float | None], digits: int = 1) -> str:
    """A family of one body has no interval."""
    mean, *ends = (_number(value, digits) for value in interval if value is not None)
    return f"{mean} [{', '.join(ends)}]" if ends else mean


def _number(value: float, digits: int) -> str:
    return f"{value:+.{digits}f}".replace("-", "−")


def _write_csv(blocks: BlockResults, path: Path) -> None:
    """A line a body and row."""
    file = io.StringIO(newline="")
    lines = csv.writer(file)
    head: list[str] | None = None
    for block, truth, results in blocks:
        for result in results:
            numbers = columns(result.figures, results[0].figures)
            if head is None:
                head = list(numbers)
                lines.writerow(["block", "row", "body", "family", *head])
            for body, family in enumerate(truth.family.tolist()):
                values = [f"{numbers[key][body]:.3f}" for key in head]
                lines.writerow([block.name, result.row.name, body, family, *values])
    write_whole(path, file.getvalue())


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
    with matplotlib.rc_context({"svg.fonttype": "none", "svg.hashsalt": NAME}), atomic_write(path) as file:
        figure.savefig(file, format="svg", metadata={"Date": None})
