"""Does every quantity still run on lanes? `cargo bench` of the core once for each SIMD level, and each one's speed-up.

    python -m benchmarks.widths [--levels scalar,avx2,avx512] [--batch 64] [QUANTITY ...]

A quantity whose speed-up over scalar is more than 10 % below the median of all at that level is flagged: it has most
likely stopped vectorising (design: every quantity is one generic source, so all should gain alike; sorting and Newton
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
"""Nanoseconds by quantity and level."""


@click.command()
@click.argument("quantities", nargs=-1)
@click.option("--levels", default="scalar,avx2,avx512", show_default=True, help="Values of IPMAN_SIMD, scalar first.")
@click.option("--batch", default=64, show_default=True, type=click.Choice([1, 64]))
@click.option("--precision", default="f32", show_default=True, type=click.Choice(["f32", "f64"]))
def main(quantities: tuple[str, ...], levels: str, batch: int, precision: str) -> None:
    """Print quantities by SIMD level; exit with 1 when one falls out of line."""
    wanted = levels.split(",")
    times: Times = {}
    for level in wanted:
        for quantity, nanoseconds in bench(level, quantities, f"{precision}/{batch}").items():
            times.setdefault(quantity, {})[level] = nanoseconds
    lines, flagged = table(times, wanted, batch)
    click.echo("\n".join(lines))
    sys.exit(1 if flagged else 0)


def bench(level: str, quantities: tuple[str, ...], suffix: str) -> dict[str, float]:
    """Median ns of each quantity, by criterion's own files."""
    pattern = f"^({'|'.join(quantities) or '[a-z_]+'})/{suffix}$"
    command = ["cargo", "bench", "--locked", "-p", "ipman", "--bench", "quantities", "--", "--noplot", pattern]
    subprocess.run(command, cwd=ROOT, env={**os.environ, "IPMAN_SIMD": level}, check=True, stdout=subprocess.DEVNULL)
    target = Path(os.environ.get("CARGO_TARGET_DIR", ROOT / "target"))
    found = {}
    for file in (target / "criterion").glob(f"*/{suffix}/new/estimates.json"):
        quantity = file.relative_to(target / "criterion").parts[0]
        if not quantities or quantity in quantities:
            found[quantity] = json.loads(file.read_text())["median"]["point_estimate"]
    return found


def table(times: Times, levels: list[str], batch: int) -> tuple[list[str], list[str]]:
    """The printed lines, and the quantities out of line."""
    first = levels[0]
    medians = {
        level: statistics.median(of_level[first] / of_level[level] for of_level in times.values()) for level in levels
    }
    lines = ["quantity".ljust(20) + "".join(f"{level:>24}" for level in levels)]
    flagged = []
    for quantity, of_level in sorted(times.items()):
        cells = []
        for level in levels:
            ratio = of_level[first] / of_level[level]
            slow = ratio < (1 - TOLERANCE) * medians[level]
            cells.append(f"{of_level[level] / batch / 1000:11.1f} µs {ratio:6.2f}×{' !' if slow else '  '}")
            if slow and quantity not in flagged:
                flagged.append(quantity)
        lines.append(quantity.ljust(20) + "".join(f"{cell:>24}" for cell in cells))
    lines.append("median".ljust(20) + "".join(f"{f'{medians[level]:.2f}×  ':>24}" for level in levels))
    return lines, flagged


if __name__ == "__main__":
    main()
