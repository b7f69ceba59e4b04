"""What the intuitive-physics terms cost in a training step: ours, and the paper's formulas as research code has them.

python -m benchmarks.training [--rounds 7] [--out docs/results/training_cost.json]

Milliseconds of processor time of one thread for an image: of whole steps (encoder, regressor, body, SPIN's terms,
backward pass, Adam) without the terms and with them, in turns, and of the terms alone, with the way to the world and
back.
"""

from __future__ import annotations

import json
import statistics
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import click
import torch
from torch import Tensor, nn

import ipman_rs.torch as ipt
from ipman_rs.synthetic import population
from ipman_rs.training.batch import Batch
from ipman_rs.training.lifting import views
from ipman_rs.training.lifting.network import lifting_network
from ipman_rs.training.losses import Loss, PhysicsLoss
from ipman_rs.training.model import HMR, MeanParameters
from ipman_rs.training.model.keypoint_encoder import KEYPOINTS
from ipman_rs.training.posed_estimate import Posed, Posing
from ipman_rs.training.world import to_world

from .peers.literal import Literal

# Backbone, pixels, images a step, body.
CASES = (
    ("resnet50", 224, 8, "anny-lite"),
    ("resnet50", 224, 8, "anny"),
    ("small", 96, 32, "anny-lite"),
    ("keypoints", 0, 64, "anny-lite"),
)
WITHOUT = "without"


class LiteralTerms(nn.Module):
    """The peer in the place of `Physics`."""

    def __init__(self, template: Any) -> None:
        super().__init__()
        self.literal = Literal(template)

    def forward(self, posed: Posed, batch: Batch) -> tuple[Tensor, dict[str, Tensor]]:
        return self.literal.weighted(to_world(posed.vertices, posed.hips(batch.regressed), batch)), {}


@click.command()
@click.option("--rounds", type=click.IntRange(1), default=7, show_default=True)
@click.option("--out", type=click.Path(dir_okay=False, path_type=Path), help="JSON.")
def main(rounds: int, out: Path | None) -> None:
    torch.set_num_threads(1)
    found = [measured(*case, rounds) for case in CASES]
    print("| | step without | + paper-r | + balanced | + literal | paper-r alone | balanced alone | literal alone |")
    print("|---|---|---|---|---|---|---|---|")
    for case in found:
        step, terms = case["step"], case["terms"]
        alone = " | ".join(f"{value:.2f} ({100 * value / step[WITHOUT]:.2g} %)" for value in terms.values())
        print(f"| {case['name']} | {' | '.join(f'{value:.2f}' for value in step.values())} | {alone} |")
    if out is not None:
        out.write_text(json.dumps(found, indent=1) + "\n")


def measured(backbone: str, size: int, count: int, body: str, rounds: int) -> dict[str, Any]:
    """Medians of ms an image: of steps, and of the terms alone."""
    posing = Posing(ipt.BodyModel(body), KEYPOINTS)
    template = posing.body.template
    terms = {name: PhysicsLoss(template, name) for name in ("paper-r", "balanced")} | {
        "literal": LiteralTerms(template)
    }
    batch = _batch(count, size, posing)
    model = (
        lifting_network(0) if backbone == "keypoints" else HMR.of_images(MeanParameters.of(posing.body.body), backbone)
    )
    optimizer = torch.optim.Adam(model.parameters(), lr=1e-5)

    def step(physics: nn.Module | None) -> Callable[[], None]:
        loss = Loss(posing, physics)  # type: ignore[arg-type]

        def run() -> None:
            optimizer.zero_grad()
            loss(model(batch.inputs), batch)[0].backward()
            optimizer.step()

        return run

    with torch.no_grad():
        posed = posing(model(batch.inputs))
    leaf = posed.vertices.clone().requires_grad_()

    def alone(physics: nn.Module) -> Callable[[], None]:
        def run() -> None:
            torch.autograd.grad(physics(Posed(leaf, posed.joints, posed.keypoints), batch)[0], leaf)

        return run

    steps = {WITHOUT: step(None)} | {name: step(physics) for name, physics in terms.items()}
    name = f"{backbone}{f', {size} px' if size else ''}, batch of {count}; {body}, {template.num_vertices:,} vertices"
    return {
        "name": name,
        "step": _medians(steps, rounds, count),
        "terms": _medians({key: alone(physics) for key, physics in terms.items()}, rounds, count),
    }


def _batch(count: int, size: int, posing: Posing) -> Batch:
    """People on the floor, seen as keypoints or as images of noise."""
    from dataclasses import replace

    seen = views.views(population.draw_population(count, 7), 7)
    images = torch.randn(count, 3, size, size, generator=torch.Generator().manual_seed(0)) if size else seen.inputs
    return replace(seen, inputs=images)


def _medians(runs: dict[str, Callable[[], None]], rounds: int, count: int) -> dict[str, float]:
    """Milliseconds an image; the runs take turns, after one that is not counted."""
    times: dict[str, list[float]] = {name: [] for name in runs}
    for turn in range(rounds + 1):
        for name, run in runs.items():
            start = time.process_time()
            run()
            if turn:
                times[name].append(1e3 * (time.process_time() - start) / count)
    return {name: statistics.median(values) for name, values in times.items()}


if __name__ == "__main__":
    main()
