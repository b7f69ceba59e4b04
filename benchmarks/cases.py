"""The grid: which peers meet on which bodies, batches and threads."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np
import torch
from torch import Tensor

from ipman_rs import presets

from . import bodies
from .measure import MIN_TURNS, Row, Times, interleaved, relative_error, use_threads
from .peers import skinning
from .peers.best_torch import BestTorch
from .peers.literal import Literal
from .peers.metrics import Metrics
from .peers.ours import Ours
from .peers.vectorised import Vectorised

LOSS_PEERS: dict[str, Callable[..., Any]] = {
    "literal": Literal,
    "eager torch": Vectorised,
    "best torch": BestTorch,
    "ours": Ours,
}


@dataclass(frozen=True)
class Budget:
    """Which cases run, and for how long each."""

    batches: tuple[int, ...] = (1, 8, 64, 512)
    threads: tuple[int, ...] = (1, 2)
    bodies: tuple[str, ...] = ("lite", "smpl", "full")
    presets: tuple[str, ...] = ("paper-r", "balanced")
    skinned: tuple[int, ...] = (1, 32)
    metric_batch: int = 8
    seconds: float = 4.0
    min_turns: int = MIN_TURNS


QUICK = Budget(batches=(1, 8, 64), threads=(1,), bodies=("smpl",), presets=("paper-r",), seconds=2.5, min_turns=3)


def rows(budget: Budget) -> Iterator[Row]:
    """All rows, the ones that matter most first."""
    yield from _metrics(budget)
    yield from _skinning(budget)
    for threads in budget.threads:
        use_threads(threads)
        for body in sorted(budget.bodies, key=lambda name: name != "smpl"):
            for preset in budget.presets:
                for batch in budget.batches:
                    yield from _losses(budget, body, preset, batch, threads)


def _losses(budget: Budget, body: str, preset: str, batch: int, threads: int) -> Iterator[Row]:
    vertices = bodies.vertices_of(body, batch)
    peers = {
        name: LOSS_PEERS[name](bodies.body(body).template, preset) for name in _names(body, preset, batch, threads)
    }
    weights = torch.tensor(list(presets.get(preset).weights.values()))[:, None] / batch
    for case in ("weighted", "terms"):

        def total(peer: Any, vertices: Tensor = vertices, case: str = case) -> Tensor:
            if case == "weighted":
                return peer.weighted(vertices)
            return (peer.terms(vertices) * weights.to(vertices.dtype)).sum()

        expected = None
        if batch <= 64:
            double = vertices.detach().double().requires_grad_()
            expected = _value_and_gradient(
                lambda x=double: total(Vectorised(bodies.body(body).template, preset), x), double
            )
        runs = {name: _step(lambda peer=peer: total(peer), vertices) for name, peer in peers.items()}
        times = interleaved(runs, budget.seconds, budget.min_turns)
        for name in peers:
            errors: tuple[float | None, float | None] = (None, None)
            if expected is not None:
                found = _value_and_gradient(lambda name=name: total(peers[name]), vertices)
                errors = relative_error(found[0], expected[0]), relative_error(found[1], expected[1])
            yield Row(case, body, preset, batch, threads, name, *_microseconds(times[name], batch), *errors)


def _names(body: str, preset: str, batch: int, threads: int) -> list[str]:
    """The literal and the eager code would need minutes at 512; best torch, minutes to compile, meets the others on the
    body that matters and once on each other one. The literal code and best torch have no balance cost."""
    names = ["ours"] if batch > 64 else ["eager torch", "ours"]
    if preset == "paper-r":
        names += ["literal"] if batch <= 64 else []
        torch._dynamo.reset()  # or its limit on recompilations is reached
        names += ["best torch"] if body == "smpl" or (batch, threads) == (64, 1) else []
    return [name for name in LOSS_PEERS if name in names]


def _skinning(budget: Budget) -> Iterator[Row]:
    """Forward and backward to pose, betas and translation."""
    peers = {"smplx": skinning.Smplx(), "torch": skinning.TorchSkinning(), "ours": skinning.OurSkinning()}
    reference = skinning.TorchSkinning(torch.float64)
    for threads in budget.threads:
        use_threads(threads)
        for batch in budget.skinned:
            inputs = skinning.parameters(batch)
            upstream = torch.randn(batch, 6_890, 3, generator=torch.Generator().manual_seed(1))

            def run(peer: Any, inputs: Any = inputs, upstream: Tensor = upstream) -> Tensor:
                vertices = peer(*inputs)
                for value in inputs:
                    value.grad = None
                vertices.backward(upstream.to(vertices.dtype))
                return vertices

            doubles = skinning.parameters(batch, torch.float64)
            expected = run(reference, doubles)
            times = interleaved(
                {name: (lambda peer=peer: run(peer)) for name, peer in peers.items()}, budget.seconds, budget.min_turns
            )
            for name in peers:
                value = relative_error(run(peers[name]), expected)
                gradient = max(relative_error(a.grad, b.grad) for a, b in zip(inputs, doubles, strict=True))
                found = _microseconds(times[name], batch)
                yield Row("skinning", "smpl", "", batch, threads, name, *found, value, gradient)


def _metrics(budget: Budget) -> Iterator[Row]:
    """From vertices to BoSE or margin, and to volume, centre of mass and inertia; numpy, one thread."""
    use_threads(1)
    template = bodies.body("smpl").template
    metrics, literal = Metrics(template), Literal(template)
    batch = budget.metric_batch
    exact = bodies.posed_batch(bodies.body("smpl"), batch)
    vertices = exact.astype(np.float32)
    groups: dict[str, dict[str, Callable[[Any], Any]]] = {
        "support": {
            "literal LP": lambda x: literal.is_supported(torch.from_numpy(x)),
            "scipy ConvexHull": metrics.scipy_margin,
            "ours": metrics.our_margin,
        },
        "mass": {"trimesh": metrics.trimesh_mass, "ours": metrics.our_mass},
    }
    for case, peers in groups.items():
        expected = {name: peer(exact) for name, peer in peers.items()}["ours"]
        times = interleaved({n: (lambda p=p: p(vertices)) for n, p in peers.items()}, budget.seconds, budget.min_turns)
        for name in peers:
            error = _metric_error(peers[name](vertices), expected)
            yield Row(case, "smpl", "", batch, 1, name, *_microseconds(times[name], batch), error)


def _microseconds(times: Times, batch: int) -> tuple[float, float, int]:
    """A body: the median, that of the first calls, and the number of calls."""
    further, first = (1e6 * seconds / batch for seconds in times.medians())
    return further, first, len(times.first) + len(times.further)


def _metric_error(found: Any, expected: Any) -> float:
    """Of a tuple the largest; of a truth value the share of bodies on which it is another; of margins only those
    inside, where the distance to scipy's lines is the distance to the polygon."""
    if isinstance(found, tuple):
        return max(relative_error(a, b) for a, b in zip(found, expected, strict=True))
    if found.dtype == bool:
        return float((found != (expected >= 0)).mean())
    inside = expected > 0
    return relative_error(found[inside], expected[inside]) if inside.any() else 0.0


def _step(total: Callable[[], Tensor], vertices: Tensor) -> Callable[[], None]:
    def run() -> None:
        vertices.grad = None
        total().backward()

    return run


def _value_and_gradient(total: Callable[[], Tensor], vertices: Tensor) -> tuple[Tensor, Tensor]:
    vertices.grad = None
    value = total()
    value.backward()
    assert vertices.grad is not None
    return value.detach(), vertices.grad.clone()
