"""Does every room still run on lanes? `cargo bench` of the core once for each SIMD level, and each room's speed-up.

    python -m benchmarks.widths [--levels scalar,avx2,avx512] [--batch 64] [ROOM ...]

A room whose speed-up over scalar is more than 10 % below the median of all rooms at that level is flagged: it has most
likely stopped vectorising (design: every room is one generic source, so all should gain alike; sorting and Newton
steps, in `support` and `balance`, gain less).
"""

from __future__ import annotations

import json
import os
import statistics
import subprocess
import sys
from pathlib import Path

import click

ROOT = Path(__file__).resolve().parents[1]
TOLERANCE = 0.1

Times = dict[str, dict[str, float]]
"""Nanoseconds by room and level."""


@click.command()
@click.argument("rooms", nargs=-1)
@click.option("--levels", default="scalar,avx2,avx512", show_default=True, help="Values of IPMAN_SIMD, scalar first.")
@click.option("--batch", default=64, show_default=True, type=click.Choice([1, 64]))
@click.option("--precision", default="f32", show_default=True, type=click.Choice(["f32", "f64"]))
def main(rooms: tuple[str, ...], levels: str, batch: int, precision: str) -> None:
    """Print rooms by SIMD level; exit with 1 when a room falls out of line."""
    wanted = levels.split(",")
    times: Times = {}
    for level in wanted:
        for room, nanoseconds in bench(level, rooms, f"{precision}/{batch}").items():
            times.setdefault(room, {})[level] = nanoseconds
    lines, flagged = table(times, wanted, batch)
    click.echo("\n".join(lines))
    sys.exit(1 if flagged else 0)


def bench(level: str, rooms: tuple[str, ...], suffix: str) -> dict[str, float]:
    """Median ns of each room, by criterion's own files."""
    pattern = f"^({'|'.join(rooms) or '[a-z_]+'})/{suffix}$"
    command = ["cargo", "bench", "--locked", "-p", "ipman", "--bench", "rooms", "--", "--noplot", pattern]
    subprocess.run(command, cwd=ROOT, env={**os.environ, "IPMAN_SIMD": level}, check=True, stdout=subprocess.DEVNULL)
    target = Path(os.environ.get("CARGO_TARGET_DIR", ROOT / "target"))
    found = {}
    for file in (target / "criterion").glob(f"*/{suffix}/new/estimates.json"):
        room = file.relative_to(target / "criterion").parts[0]
        if not rooms or room in rooms:
            found[room] = json.loads(file.read_text())["median"]["point_estimate"]
    return found


def table(times: Times, levels: list[str], batch: int) -> tuple[list[str], list[str]]:
    """The printed lines, and the rooms out of line."""
    first = levels[0]
    medians = {
        level: statistics.median(of_level[first] / of_level[level] for of_level in times.values()) for level in levels
    }
    lines = ["room".ljust(20) + "".join(f"{level:>24}" for level in levels)]
    flagged = []
    for room, of_level in sorted(times.items()):
        cells = []
        for level in levels:
            ratio = of_level[first] / of_level[level]
            slow = ratio < (1 - TOLERANCE) * medians[level]
            cells.append(f"{of_level[level] / batch / 1000:11.1f} µs {ratio:6.2f}×{' !' if slow else '  '}")
            if slow and room not in flagged:
                flagged.append(room)
        lines.append(room.ljust(20) + "".join(f"{cell:>24}" for cell in cells))
    lines.append("median".ljust(20) + "".join(f"{f'{medians[level]:.2f}×  ':>24}" for level in levels))
    return lines, flagged


if __name__ == "__main__":
    main()
