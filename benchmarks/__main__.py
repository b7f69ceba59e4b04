"""`make bench`: runs every peer and writes docs/results/performance.md, .svg and .json.

python -m benchmarks [--quick] [--out docs/results]
"""

from __future__ import annotations

import json
import os
import subprocess
import sys
import tempfile
import time
import warnings
from dataclasses import asdict, replace
from pathlib import Path
from typing import Any

import click

from . import bodies, cases, measure, report

RESULTS = Path(__file__).resolve().parents[1] / "docs" / "results"
MEMORY_BATCH = 64


@click.group(invoke_without_command=True)
@click.option("--quick", is_flag=True, help="Only the body of SMPL's size, one thread, B = 1, 8, 64.")
@click.option("--seconds", type=float, help="Measuring time of each case.")
@click.option("--out", type=click.Path(file_okay=False, path_type=Path), default=RESULTS, show_default=True)
@click.pass_context
def main(context: click.Context, quick: bool, seconds: float | None, out: Path) -> None:
    """Run the benchmarks and write performance.md, performance.svg and performance.json to OUT."""
    if context.invoked_subcommand is not None:
        return
    warnings.filterwarnings("ignore", message=".*[Ss]parse.*")
    # Not the user's cache: a run that was killed while it compiled would leave half a library there.
    os.environ["TORCHINDUCTOR_CACHE_DIR"] = tempfile.mkdtemp(prefix="ipman-bench-")
    start = time.perf_counter()
    budget = cases.QUICK if quick else cases.Budget()
    if seconds is not None:
        budget = replace(budget, seconds=seconds)
    rows = []
    for row in cases.rows(budget):
        rows.append(asdict(row))
        click.echo(
            f"{row.case:9} {row.body:5} {row.preset:9} B={row.batch:<4} threads={row.threads} {row.peer:17}"
            f"{row.microseconds:11.1f} µs a body"
        )
    result = {
        "quick": quick,
        "machine": measure.machine(),
        "minutes": round((time.perf_counter() - start) / 60, 1),
        "rows": rows,
        "memory": {} if quick else {peer: _memory_of(peer) for peer in cases.LOSS_PEERS},
    }
    out.mkdir(parents=True, exist_ok=True)
    (out / "performance.json").write_text(json.dumps(result, indent=1) + "\n")
    report.write(result, out)
    click.echo(f"{out / 'performance.md'} after {result['minutes']} minutes")


@main.command("report")
@click.pass_context
def again(context: click.Context) -> None:
    """Write the page again from performance.json, after the frame in benchmarks/performance.md.j2 was edited."""
    out = context.parent.params["out"] if context.parent else RESULTS
    report.write(json.loads((out / "performance.json").read_text()), out)


@main.command(hidden=True)
@click.argument("peer", type=click.Choice(list(cases.LOSS_PEERS)))
def memory(peer: str) -> None:
    """Print the megabytes that one forward and backward adds."""
    measure.use_threads(1)
    vertices = bodies.vertices_of("smpl", MEMORY_BATCH)
    made: Any = cases.LOSS_PEERS[peer](bodies.body("smpl").template)
    click.echo(measure.peak_megabytes(lambda: made.weighted(vertices).backward()))


def _memory_of(peer: str) -> float:
    """In a process of its own."""
    command = [sys.executable, "-W", "ignore", "-m", "benchmarks", "memory", peer]
    root = Path(__file__).resolve().parents[1]
    done = subprocess.run(command, capture_output=True, text=True, check=True, cwd=root)
    return float(done.stdout)


if __name__ == "__main__":
    main()
