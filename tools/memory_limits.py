"""Every public function under every memory limit: it answers, or raises MemoryError. No panic, no abort, no hang.

`python tools/memory_limits.py` runs each function in a process of its own, with 0.2 to 2 GB of address space above what
Python and the inputs take, with and without RUST_BACKTRACE=1; some minutes. Linux only: other systems do not hold to
the limit.
"""

from __future__ import annotations

import argparse
import os
import subprocess
import sys
from collections.abc import Callable
from typing import Any

import numpy as np

SECONDS = 120.0  # a process that takes longer hangs
GB = 1e9


def capsule(sides: int, rings: int, parts: int = 1) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """A closed surface of 2 + sides · rings vertices: positions, faces and the faces' parts."""
    polar = np.pi * np.arange(1, rings + 1) / (rings + 1)
    around = 2 * np.pi * np.arange(sides) / sides
    y = np.repeat(0.85 * (1 - np.cos(polar)), sides)
    x, z = (np.outer(np.sin(polar), turn(around)).reshape(-1) for turn in (np.cos, np.sin))
    points = np.vstack([[0, 0, 0], np.column_stack([0.2 * x, y, 0.15 * z]), [0, 1.7, 0]])
    side = np.arange(sides)
    low = 1 + np.arange(rings - 1)[:, None] * sides + side
    beside = 1 + np.arange(rings - 1)[:, None] * sides + (side + 1) % sides
    last, top = 1 + (rings - 1) * sides, len(points) - 1
    quads = [[low, low + sides, beside], [beside, low + sides, beside + sides]]
    faces = [np.stack(corners, -1).reshape(-1, 3) for corners in quads]
    bottom = np.column_stack([np.zeros_like(side), 1 + side, 1 + (side + 1) % sides])
    cap = np.column_stack([last + side, np.full_like(side, top), last + (side + 1) % sides])
    faces = np.concatenate([bottom, *faces, cap])
    height = points[faces, 1].mean(1)
    return points, faces, np.minimum((height / 1.7 * parts).astype(np.int64), parts - 1)


def calls() -> dict[str, Callable[[], Callable[[], Any]]]:
    """Each case prepares its inputs and returns what is called under the limit."""
    import ipman_rs as ip
    from ipman_rs.simulation import simulate, tip_test

    ground = ip.Ground()

    def template(sides: int, rings: int, parts: int = 1, **options: Any) -> Any:
        surface = capsule(sides, rings, parts)
        return lambda: ip.BodyTemplate(*surface, **options)

    def bodies(function: Callable[..., Any], count: int, samples: int = 20_000, **options: Any) -> Any:
        body = ip.BodyTemplate(*capsule(40, 40, 4), num_samples=samples)
        vertices = np.repeat(body.vertices[None].astype(np.float32), count, 0)
        return lambda: function(vertices, body, ground, **options)

    def self_contact(function: Callable[..., Any], count: int) -> Any:
        body = ip.BodyTemplate(*capsule(20, 20, 4), num_samples=100)
        vertices = np.repeat(body.vertices[None].astype(np.float32), count, 0)
        return lambda: function(vertices, body)

    def gradient(quantity: str, count: int) -> Any:
        from ipman_rs import _core

        body = ip.BodyTemplate(*capsule(40, 40, 4), num_samples=20_000)
        vertices = np.repeat(body.vertices[None].astype(np.float32), count, 0)
        asked = _core.Quantity(body._core, quantity, [])
        d_out = np.ones((count, asked.num_outputs), np.float32)
        over = np.array([[0, 1.0, 0]]), np.zeros(1)
        return lambda: asked.value_and_vjp(vertices, *over, d_out)

    def terms(count: int) -> Any:
        from ipman_rs import quantities

        body = ip.BodyTemplate(*capsule(40, 40, 4), num_samples=20_000)
        vertices = np.repeat(body.vertices[None].astype(np.float32), count, 0)
        over = np.array([[0, 1.0, 0]]), np.zeros(1)
        preset = ip.presets.get("paper-r")
        asked = quantities.physics_terms(preset, "pcom", "samples", "tanh_squared", "log").of(body)
        return lambda: asked.weighted(vertices, *over, [1.0, 1.0, 1.0], None, "mean")

    def skinning(count: int) -> Any:
        model = ip.load_body("anny-lite")
        return lambda: model.forward(np.zeros((count, model.num_joints, 3), np.float32))

    def samples(count: int) -> Any:
        body = ip.BodyTemplate(*capsule(20, 20), num_samples=count)
        return lambda: (body.sample_faces, body.sample_barycentric, body.sample_parts)

    return {
        "template of 1e6 faces": lambda: template(1000, 500),
        "template of 1e6 faces in 100 parts": lambda: template(1000, 500, 100),
        "template of 1e7 samples": lambda: template(40, 40, 4, num_samples=10_000_000),
        "samples' arrays": lambda: samples(5_000_000),
        "pressure": lambda: bodies(ip.pressure, 4_000),
        "pressure of 1e6 samples": lambda: bodies(ip.pressure, 30, 1_000_000),
        "sample_surface": lambda: bodies(lambda v, t, g: ip.sample_surface(v, t), 4_000),
        "analyze": lambda: bodies(ip.analyze, 4_000),
        "analyze of 1e6 samples": lambda: bodies(ip.analyze, 30, 1_000_000),
        "base_of_support": lambda: bodies(ip.base_of_support, 4_000),
        "support_margin": lambda: bodies(ip.support_margin, 4_000),
        "stability_loss": lambda: bodies(ip.stability_loss, 4_000),
        "ground_loss": lambda: bodies(ip.ground_loss, 4_000),
        "balance_cost": lambda: bodies(ip.balance_cost, 4_000),
        "mass_properties": lambda: bodies(lambda v, t, g: ip.mass_properties(v, t), 4_000),
        "tip_test": lambda: bodies(tip_test, 500),
        "simulate": lambda: bodies(simulate, 20),
        "gradient of the samples": lambda: gradient("sample_surface", 2_000),
        "terms": lambda: terms(8_000),
        "self_contact_loss": lambda: self_contact(ip.self_contact_loss, 8_000),
        "self_penetration": lambda: self_contact(ip.self_penetration, 2_000),
        "skinning": lambda: skinning(20_000),
    }


def limited(name: str, spare: float) -> None:
    """Calls one function with `spare` GB of address space left, and says what came of it."""
    import resource

    call = calls()[name]()
    with open("/proc/self/statm") as file:
        taken = int(file.read().split()[0]) * resource.getpagesize()
    limit = int(taken + spare * GB)
    resource.setrlimit(resource.RLIMIT_AS, (limit, limit))
    try:
        call()
    except MemoryError:
        print("MemoryError")
    else:
        print("answered")


def ending(name: str, spare: float, backtrace: bool) -> str:
    """How a process of its own ends: "answered", "MemoryError", or what must not be."""
    command = [sys.executable, __file__, "--case", name, "--spare", str(spare)]
    environment = {**os.environ, "RUST_BACKTRACE": "1" if backtrace else "0"}
    try:
        run = subprocess.run(command, env=environment, capture_output=True, text=True, timeout=SECONDS)
    except subprocess.TimeoutExpired:
        return "hangs"
    if run.returncode != 0 or run.stderr:
        return f"ends with {run.returncode}: {run.stderr.strip()[-300:]}"
    return run.stdout.strip()


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--case", help="one function, by its name; with --spare: in this process")
    parser.add_argument("--spare", type=float, help="GB of address space left")
    parser.add_argument("--step", type=float, default=0.2, help="GB between two limits")
    arguments = parser.parse_args()
    if arguments.spare is not None:
        limited(arguments.case, arguments.spare)
        return 0
    bad = 0
    for name in [arguments.case] if arguments.case else calls():
        endings = [
            ending(name, spare, backtrace)
            for spare in np.arange(0.2, 2.0 + arguments.step / 2, arguments.step)
            for backtrace in (False, True)
        ]
        wrong = [each for each in endings if each not in ("answered", "MemoryError")]
        bad += len(wrong)
        answered, lacking = endings.count("answered"), endings.count("MemoryError")
        print(f"{name}: {answered} answered, {lacking} MemoryError", *wrong, flush=True)
    return 1 if bad else 0


if __name__ == "__main__":
    sys.exit(main())
