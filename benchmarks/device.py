"""Time a body of the loss and its gradient on a GPU: the Triton kernels beside every other way to compute it there.

`IntuitivePhysicsLoss.weighted` (stability, pull, push) and its backward in float32, preset paper-r, on standing bodies:

    triton      our kernels, launched one by one
    graph       the same, replayed as one CUDA graph
    torch       our path in torch operations (what runs without Triton)
    reference   the vectorised formulas, eager, autograd's backward
    compiled    the same under torch.compile
    literal     as the paper's code is organised: a loop over the parts, sparse products, autograd's backward

All run in turns in one process; times are medians of CUDA events; the last column is the largest error of our gradient
against float64. Without a GPU it says so and measures nothing.

    python benchmarks/device.py [--body anny] [--batch 1 --batch 8 --batch 64 --batch 512] [--rounds 50]
"""

from __future__ import annotations

import statistics
from collections.abc import Callable
from unittest.mock import patch

import click
import numpy as np
import torch
from rich.console import Console
from rich.table import Table
from torch import Tensor

import ipman_rs as ip
import ipman_rs.torch as ipt
from ipman_rs.torch.device import triton_terms
from ipman_rs.torch.dispatch import _reference_path
from ipman_rs.torch.reference.topology import topology

Step = Callable[[], Tensor]


def standing_bodies(model: ip.body.BodyModel, batch: int) -> Tensor:
    """Slightly different poses with the feet on the ground: (batch, V, 3) float32."""
    pose = np.random.default_rng(0).normal(scale=0.1, size=(batch, model.num_joints, 3))
    vertices = torch.from_numpy(model(pose).vertices).float()
    vertices[..., 1] -= vertices[..., 1].amin(dim=-1, keepdim=True)
    return vertices


class Literal:
    """The paper's procedure step by step, on a floor at y = 0: each part cut out, closed and filled by itself."""

    def __init__(self, template: ip.BodyTemplate, device: str) -> None:
        mesh = topology(template, torch.device(device))
        rows = template.regressor().tocoo()
        index = torch.tensor(np.stack([rows.row, rows.col]), device=device)
        weight = torch.tensor(rows.data, device=device)
        self.regressor = torch.sparse_coo_tensor(index, weight, rows.shape).coalesce()
        self.parts = mesh.triangles.split(mesh.part_sizes)
        self.ring_vertices, self.ring_components, self.ring_sizes = (
            mesh.ring_vertices,
            mesh.ring_components,
            mesh.ring_sizes,
        )
        self.sample_parts = mesh.sample_parts

    def __call__(self, vertices: Tensor) -> Tensor:
        volumes = []
        for triangles in self.parts:
            centres = [vertices[:, self.ring_vertices[self.ring_components == c]].mean(dim=1) for c in self._rings()]
            closed = torch.cat([vertices, torch.stack(centres, dim=1)], dim=1) if centres else vertices
            a, b, c = (closed[:, triangles[:, k]] for k in range(3))
            volumes.append((torch.linalg.cross(a, b) * c).sum(dim=(-1, -2)).abs() / 6)
        samples = torch.stack([torch.sparse.mm(self.regressor, body.double()) for body in vertices]).float()
        weight = torch.stack(volumes, dim=-1)[:, self.sample_parts]
        com = (samples * weight[..., None]).sum(dim=1) / weight.sum(dim=1, keepdim=True)
        height = samples[..., 1]
        load = torch.where(height < 0, 1 - 100 * height, torch.exp(-10 * height))
        cop = (samples * load[..., None]).sum(dim=1) / load.sum(dim=1, keepdim=True)
        stability = (com - cop)[:, [0, 2]].norm(dim=-1)
        pull = torch.where(height >= 0, torch.tanh(height / 0.15) ** 2, 0).mean(dim=-1)
        push = torch.where(height < 0, 10 * torch.tanh(height / 0.15) ** 2, 0).mean(dim=-1)
        return 0.01 * (stability + pull + push).mean()

    def _rings(self) -> range:
        return range(len(self.ring_sizes))


def steps(template: ip.BodyTemplate, vertices: Tensor) -> dict[str, Step]:
    """Each way to compute the gradient (B, V, 3)."""
    ground = ipt.Ground.y_up().to(vertices.device)
    loss, literal = ipt.IntuitivePhysicsLoss(template), Literal(template, str(vertices.device))

    def gradient(total: Callable[[Tensor], Tensor]) -> Tensor:
        return torch.autograd.grad(total(vertices), vertices)[0]

    def ours(v: Tensor) -> Tensor:
        return loss.weighted(v, ground)[0]

    def reference(v: Tensor) -> Tensor:
        with _reference_path():
            return ours(v)

    def in_torch() -> Tensor:
        with patch.object(triton_terms, "INSTALLED", False):
            return gradient(ours)

    compiled = torch.compile(reference)
    found = {"torch": in_torch, "reference": lambda: gradient(reference), "compiled": lambda: gradient(compiled)}
    found["literal"] = lambda: gradient(literal)
    if triton_terms.serves(vertices):
        return {"triton": lambda: gradient(ours), "graph": _captured(lambda: gradient(ours)), **found}
    return found


def _captured(step: Step) -> Step:
    """The step as one CUDA graph; see docs/understand/devices.md."""
    stream = torch.cuda.Stream()
    with torch.cuda.stream(stream):
        for _ in range(3):
            step()
    torch.cuda.synchronize()
    graph = torch.cuda.CUDAGraph()
    with torch.cuda.graph(graph):
        result = step()

    def replay() -> Tensor:
        graph.replay()
        return result

    return replay


def medians(runs: dict[str, Step], rounds: int) -> dict[str, float]:
    """Median milliseconds of each, taken in turns, after three unmeasured turns."""
    times: dict[str, list[float]] = {name: [] for name in runs}
    for turn in range(rounds + 3):
        for name, run in runs.items():
            start, end = torch.cuda.Event(enable_timing=True), torch.cuda.Event(enable_timing=True)
            torch.cuda.synchronize()
            start.record()
            run()
            end.record()
            end.synchronize()
            if turn >= 3:
                times[name].append(start.elapsed_time(end))
    return {name: statistics.median(values) for name, values in times.items()}


@click.command()
@click.option("--body", default="anny", help="An embedded body or a model file.")
@click.option("--batch", "batches", multiple=True, type=int, default=(1, 8, 64, 512))
@click.option("--rounds", default=50)
def main(body: str, batches: tuple[int, ...], rounds: int) -> None:
    """Print µs a body, forward and backward."""
    if not torch.cuda.is_available():
        print("There is no GPU here that torch can use: nothing was measured.")
        return
    model = ip.load_body(body)
    device = torch.cuda.get_device_name()
    title = f"{device}, {model.num_vertices} vertices, {model.template.num_samples} samples: µs a body"
    table = Table(title=title)
    for batch in batches:
        vertices = standing_bodies(model, batch)
        runs = steps(model.template, vertices.cuda().requires_grad_())
        found = medians(runs, rounds)
        exact = standing_bodies(model, batch).double().requires_grad_()
        with _reference_path():
            ipt.IntuitivePhysicsLoss(model.template).weighted(exact, ipt.Ground.y_up())[0].backward()
        assert exact.grad is not None
        slope = exact.grad.flatten(1)
        error = next(iter(runs.values()))().cpu().double().flatten(1) - slope
        if not table.columns:
            for column in ("batch", *found, "error"):
                table.add_column(column, justify="right")
        table.add_row(
            str(batch),
            *(f"{1e3 * milliseconds / batch:.1f}" for milliseconds in found.values()),
            f"{(error.norm(dim=1) / slope.norm(dim=1)).max():.1e}",
        )
    Console().print(table)


if __name__ == "__main__":
    main()
