"""Median time a body of the loss and its gradient: the compiled core beside plain, vectorised torch, on one CPU thread.

`IntuitivePhysicsLoss.weighted` (stability, pull, push) and its backward, in float32. Both paths run in turns in the
same process, so that a busy machine slows both.

    python benchmarks/torch_path.py [--body anny] [--batch 1 --batch 8 --batch 64] [--seconds 20]
"""

from __future__ import annotations

import statistics
import time
from collections.abc import Callable

import click
import numpy as np
import torch
from rich.console import Console
from rich.table import Table

import ipman_rs as ip
import ipman_rs.torch as ipt
from ipman_rs.torch.dispatch import _reference_path


def standing_bodies(model: ip.body.BodyModel, batch: int) -> torch.Tensor:
    """Slightly different poses with the feet on the ground: (batch, V, 3) float32."""
    generator = np.random.default_rng(0)
    pose = generator.normal(scale=0.1, size=(batch, model.num_joints, 3))
    vertices = torch.from_numpy(model(pose).vertices).float()
    vertices[..., 1] -= vertices[..., 1].amin(dim=-1, keepdim=True)
    return vertices


def step(loss: ipt.IntuitivePhysicsLoss, vertices: torch.Tensor, ground: ipt.Ground) -> None:
    """Forward and backward once."""
    vertices.grad = None
    loss.weighted(vertices, ground)[0].backward()


def forced(run: Callable[[], None]) -> Callable[[], None]:
    """`run` on the plain-torch path."""

    def run_reference() -> None:
        with _reference_path():
            run()

    return run_reference


def medians(runs: dict[str, Callable[[], None]], seconds: float) -> dict[str, float]:
    """Median seconds of each run, taken in turns for `seconds`, after one unmeasured turn."""
    times: dict[str, list[float]] = {name: [] for name in runs}
    for run in runs.values():
        run()
    end = time.perf_counter() + seconds
    while time.perf_counter() < end or min(map(len, times.values())) < 3:
        for name, run in runs.items():
            start = time.perf_counter()
            run()
            times[name].append(time.perf_counter() - start)
    return {name: statistics.median(values) for name, values in times.items()}


@click.command()
@click.option("--body", default="anny", help="An embedded body or a model file.")
@click.option("--batch", "batches", multiple=True, type=int, default=(1, 8, 64))
@click.option("--seconds", default=20.0, help="Measuring time for each batch size.")
@click.option("--preset", default="paper-r")
def main(body: str, batches: tuple[int, ...], seconds: float, preset: str) -> None:
    """Print µs a body, forward and backward."""
    torch.set_num_threads(1)
    ip.set_num_threads(1)
    model = ip.load_body(body)
    loss = ipt.IntuitivePhysicsLoss(model.template, preset)
    ground = ipt.Ground.y_up()
    table = Table(title=f"{preset}, {model.num_vertices} vertices, {model.template.num_samples} samples: µs a body")
    for column in ("batch", "compiled core", "plain torch", "ratio"):
        table.add_column(column, justify="right")
    for batch in batches:
        vertices = standing_bodies(model, batch).requires_grad_()

        def run(vertices: torch.Tensor = vertices) -> None:
            step(loss, vertices, ground)

        found = medians({"core": run, "torch": forced(run)}, seconds)
        core, plain = (1e6 * found[name] / batch for name in ("core", "torch"))
        table.add_row(str(batch), f"{core:.1f}", f"{plain:.0f}", f"{plain / core:.1f}x")
    Console().print(table)


if __name__ == "__main__":
    main()
