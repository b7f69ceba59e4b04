"""How many bodies a second `ipman analyze` reads, poses and analyses from a parameter file, and in how much memory.

python -m benchmarks.million [--bodies 1000000] [--threads 2] [--out docs/results]
"""

from __future__ import annotations

import json
import os
import resource
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from typing import Any

import click
import numpy as np

import ipman_rs as ip
from ipman_rs.body import poses

ROOT = Path(__file__).resolve().parents[1]
STAGED = 2048  # bodies whose stages are timed one by one


@click.group(invoke_without_command=True)
@click.option("--bodies", default=1_000_000, show_default=True, help="Bodies of the largest file.")
@click.option("--threads", default=2, show_default=True)
@click.option(
    "--out", type=click.Path(file_okay=False, path_type=Path), default=ROOT / "docs" / "results", show_default=True
)
@click.pass_context
def main(context: click.Context, bodies: int, threads: int, out: Path) -> None:
    """Analyse files of bodies//100, bodies//10 and all bodies, each in a process of its own; write OUT/million.json."""
    if context.invoked_subcommand is not None:
        return
    from .measure import machine

    result: dict[str, Any] = {"machine": machine(), "threads": threads, "runs": []}
    result["stages_us_a_body"] = _child("stages", threads=threads)
    for stage, microseconds in result["stages_us_a_body"].items():
        click.echo(f"{stage:24}{microseconds:8.1f} µs of one core a body")
    with tempfile.TemporaryDirectory(dir=os.environ.get("TMPDIR")) as folder:
        for count in sorted({max(bodies // 100, 1), max(bodies // 10, 1), bodies}):
            file = Path(folder) / f"{count}.npz"
            write_parameters(file, count)
            run = _child("run", str(file), str(Path(folder) / "report"), threads=threads)
            file.unlink()
            result["runs"].append({"bodies": count, **run})
            click.echo(
                f"{count:9,} bodies: {run['bodies_a_second']:8,.0f} a second, {run['cpu_us_a_body']:.0f} µs of CPU; "
                f"report {run['report_seconds']:.1f} s; "
                f"peak {run['peak_megabytes']:,.0f} MB, with the report {run['peak_megabytes_with_report']:,.0f} MB"
            )
    out.mkdir(parents=True, exist_ok=True)
    (out / "million.json").write_text(json.dumps(result, indent=1) + "\n")


def write_parameters(path: Path, count: int, seed: int = 0) -> None:
    """Poses around the named ones, each near the floor y = 0: pose (T, 72), betas (10,), transl (T, 3), float32."""
    body = ip.load_body("anny")
    rng = np.random.default_rng(seed)
    named = np.stack([poses.pose(name) for name in poses.NAMES])
    lowest = body(named).vertices[..., 1].min(axis=-1)
    which = rng.integers(len(named), size=count)
    pose = rng.standard_normal((count, 72), np.float32)
    pose *= 0.05
    pose += named.reshape(-1, 72).astype(np.float32)[which]
    transl = np.zeros((count, 3), np.float32)
    transl[:, 1] = -lowest[which]
    np.savez(path, pose=pose, betas=np.zeros(10, np.float32), transl=transl)


def _child(*command: str, threads: int) -> dict[str, Any]:
    environment = {**os.environ, "RAYON_NUM_THREADS": str(threads), "OMP_NUM_THREADS": "1"}
    arguments = [sys.executable, "-m", "benchmarks.million", *command]
    done = subprocess.run(arguments, stdout=subprocess.PIPE, text=True, check=True, cwd=ROOT, env=environment)
    return json.loads(done.stdout)


@main.command(hidden=True)
@click.argument("file", type=click.Path(path_type=Path))
@click.argument("report", type=click.Path(path_type=Path))
def run(file: Path, report: Path) -> None:
    """What `ipman analyze FILE --ground 0 -o REPORT` does, timed."""
    from ipman_rs.study.from_file import Request, analyze_file
    from ipman_rs.view.report import write_report

    start, used = time.perf_counter(), time.process_time()
    study = analyze_file(file, Request(ground=0.0))
    seconds, cpu = time.perf_counter() - start, time.process_time() - used
    peak = _peak_megabytes()
    write_report([study], report)
    result = {
        "seconds": seconds,
        "bodies_a_second": study.num_frames / seconds,
        "cpu_us_a_body": 1e6 * cpu / study.num_frames,
        "report_seconds": time.perf_counter() - start - seconds,
        "peak_megabytes": peak,
        "peak_megabytes_with_report": _peak_megabytes(),
    }
    click.echo(json.dumps(result))


def _peak_megabytes() -> float:
    """Linux counts kilobytes, macOS bytes."""
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / (1e6 if sys.platform == "darwin" else 1e3)


@main.command(hidden=True)
def stages() -> None:
    """µs of one core a body for posing and for analysis."""
    from ipman_rs.analysis import PIECE, analyze_sequence
    from ipman_rs.io.parameters import read_npz

    ip.set_num_threads(1)
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "bodies.npz"
        write_parameters(file, STAGED)
        bodies: Any = read_npz(file, "anny").vertices
    template = bodies.body.template
    times: dict[str, list[float]] = {"posing": [], "posing and analysis": []}
    for _ in range(3):
        start = time.process_time()
        for _piece in bodies.pieces(PIECE):
            pass
        times["posing"].append(time.process_time() - start)
        start = time.process_time()
        for _part in analyze_sequence(bodies, template, ip.Ground()):
            pass
        times["posing and analysis"].append(time.process_time() - start)
    click.echo(json.dumps({name: round(1e6 * min(each) / STAGED, 1) for name, each in times.items()}))


if __name__ == "__main__":
    main()
