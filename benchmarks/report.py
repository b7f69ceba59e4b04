"""The page: tables and a plot from the measured rows, in the frame of performance.md.j2."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import jinja2

from . import bodies

HERE = Path(__file__).resolve().parent
PEERS = ("literal", "eager torch", "best torch", "ours")
TARGETS = (
    ("weighted, against literal", "weighted", "literal", {1: 80, 8: 100, 64: 150}),
    ("weighted, against best torch with fixed weights", "weighted", "best torch", {1: 5, 8: 8, 64: 10}),
    ("separate terms, against best torch", "terms", "best torch", {1: 4, 8: 6, 64: 7}),
)

Rows = list[dict[str, Any]]


def write(result: dict[str, Any], out: Path) -> None:
    """performance.md and performance.svg."""
    rows, million = result["rows"], out / "million.json"
    environment = jinja2.Environment(
        loader=jinja2.FileSystemLoader(HERE), trim_blocks=True, lstrip_blocks=True, keep_trailing_newline=True
    )
    page = environment.get_template("performance.md.j2").render(
        quick=result["quick"],
        minutes=result["minutes"],
        machine=result["machine"],
        goals=_goals(rows),
        others=_others(rows),
        grids=_grids(rows),
        memory=result["memory"],
        million=json.loads(million.read_text()) if million.is_file() else None,
    )
    (out / "performance.md").write_text(page)
    _plot(rows, out / "performance.svg")


def microseconds(rows: Rows, which: str = "microseconds", **wanted: Any) -> dict[str, float]:
    """µs a body of each peer in the case that `wanted` describes; with `which` "first", of the turns' first calls."""
    return {row["peer"]: row[which] for row in _where(rows, **wanted)}


def _where(rows: Rows, **wanted: Any) -> Rows:
    return [row for row in rows if all(row[key] == value for key, value in wanted.items())]


def _goals(rows: Rows) -> list[list[str]]:
    """The ratios that the project set out for with the goal beside each, and those of the turns' first calls."""
    table = []
    for title, case, peer, goals in TARGETS:
        cells = [title]
        for batch, goal in goals.items():
            case_of = {"case": case, "body": "smpl", "preset": "paper-r", "batch": batch, "threads": 1}
            first = _ratio(microseconds(rows, "first", **case_of), peer, None)
            cells.append(f"{_ratio(microseconds(rows, **case_of), peer, goal)}; first calls {first}")
        table.append(cells)
    return table


def _others(rows: Rows) -> list[list[str]]:
    """Skinning and metrics: case, batch, peer, µs, ours, ratio."""
    table = []
    goals: dict[tuple[Any, ...], int] = {("support", "literal LP"): 100, ("support", "scipy ConvexHull"): 5}
    goals |= {("skinning", "torch", 1): 4, ("skinning", "torch", 32): 3}
    for case in ("support", "mass", "skinning"):
        for row in _where(rows, case=case):
            if row["peer"] == "ours":
                continue
            same = {key: row[key] for key in ("case", "batch", "threads")}
            found = microseconds(rows, **same)
            goal = goals.get((case, row["peer"]), goals.get((case, row["peer"], row["batch"])))
            ours = _where(rows, **same, peer="ours")[0]
            table.append(
                [
                    f"{case}, {row['peer']}", str(row["batch"]), str(row["threads"]), _number(row["microseconds"]),
                    _number(found["ours"]), _ratio(found, row["peer"], goal),
                    _error(row["value_error"]), _error(ours["value_error"]),
                ]
            )  # fmt: skip
    return table


def _grids(rows: Rows) -> list[dict[str, Any]]:
    """One table a body, preset and number of threads."""
    losses = [row for row in rows if row["case"] in ("weighted", "terms")]
    keys = dict.fromkeys((row["body"], row["preset"], row["threads"]) for row in losses)
    grids = []
    for body, preset, threads in keys:
        lines = []
        for row in _where(losses, body=body, preset=preset, threads=threads):
            found = microseconds(losses, **{k: row[k] for k in ("case", "body", "preset", "batch", "threads")})
            ratio = "" if row["peer"] == "ours" else _ratio(found, row["peer"], None)
            lines.append(
                [
                    {"weighted": "weighted", "terms": "separate"}[row["case"]], str(row["batch"]), row["peer"],
                    _number(row["microseconds"]), _number(row["first"]), ratio,
                    _error(row["value_error"]), _error(row["gradient_error"]), str(row["calls"]),
                ]
            )  # fmt: skip
        counts = f"{bodies.VERTICES[body]:,} vertices, {preset}, {threads} thread{'s' if threads > 1 else ''}"
        grids.append({"title": counts, "lines": lines})
    return grids


def _ratio(found: dict[str, float], peer: str, goal: int | None) -> str:
    if peer not in found or "ours" not in found:
        return "–"
    ratio = found[peer] / found["ours"]
    text = f"{ratio:.0f}×" if ratio >= 20 else f"{ratio:.1f}×" if ratio >= 2 else f"{ratio:.2f}×"
    if goal is None:
        return text
    return f"**{text}** (≥ {goal}×)" if ratio >= goal else f"{text} (missed: ≥ {goal}×)"


def _number(value: float) -> str:
    return f"{value:,.0f}" if value >= 100 else f"{value:.1f}"


def _error(value: float | None) -> str:
    return "" if value is None else "0" if value == 0 else f"{value:.0e}".replace("e-0", "e-")


def _plot(rows: Rows, path: Path) -> None:
    """µs a body over the batch size, on the body of SMPL's size with one thread."""
    from matplotlib.backends.backend_svg import FigureCanvasSVG
    from matplotlib.figure import Figure

    figure = Figure(figsize=(9, 4), layout="constrained")
    FigureCanvasSVG(figure)
    styles = {"literal": ("#8c8c8c", "s"), "eager torch": ("#4c78a8", "^"), "best torch": ("#f58518", "D")}
    styles["ours"] = ("#2a9d55", "o")
    for axes, case in zip(figure.subplots(1, 2, sharey=True), ("weighted", "terms"), strict=True):
        for peer in PEERS:
            points = _where(rows, case=case, body="smpl", preset="paper-r", threads=1, peer=peer)
            color, marker = styles[peer]
            axes.loglog(
                [row["batch"] for row in points], [row["microseconds"] for row in points],
                color=color, marker=marker, label=peer, linewidth=2,
            )  # fmt: skip
        axes.set_title({"weighted": "weighted total", "terms": "separate terms"}[case])
        axes.set_xlabel("bodies in the batch")
        axes.set_xticks([1, 8, 64, 512], ["1", "8", "64", "512"])
        axes.minorticks_off()
        axes.grid(alpha=0.3)
    figure.axes[0].set_ylabel("µs per body, forward and backward")
    figure.axes[0].legend(frameon=False)
    figure.suptitle("6,890 vertices, 20,000 samples, float32, one thread")
    figure.savefig(path, metadata={"Date": None})
