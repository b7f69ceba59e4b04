"""The Triton kernels, run by Triton's interpreter on the CPU. Its switch must be set before triton is imported, so the
tests below run in a process of their own, started by the first."""

from __future__ import annotations

import os
import subprocess
import sys
from importlib.util import find_spec

import pytest
import torch

import ipman_rs as ip
from ipman_rs.torch.dispatch import _device_path, _reference_path
from tests.helpers import device_cases as cases

INTERPRETED = os.environ.get("TRITON_INTERPRET") == "1"
pytestmark = pytest.mark.skipif(find_spec("triton") is None, reason="triton is not installed (PyPI has it for Linux)")
inside = pytest.mark.skipif(not INTERPRETED, reason="run by test_in_the_interpreter, in a process of its own")


@pytest.mark.slow
@pytest.mark.skipif(INTERPRETED, reason="already in the interpreter")
def test_in_the_interpreter():
    command = [sys.executable, "-m", "pytest", "-q", "-p", "no:cacheprovider", "-n", "0", __file__]
    done = subprocess.run(command, env={**os.environ, "TRITON_INTERPRET": "1"}, capture_output=True, text=True)
    assert done.returncode == 0, done.stdout + done.stderr
    assert "failed" not in done.stdout
    assert " passed" in done.stdout


@inside
def test_against_the_reference():
    model = ip.load_body("anny-lite")
    old = model.template
    few = ip.BodyTemplate(old.vertices, old.faces, old.face_parts, num_samples=1000)
    vertices, ground = cases.people(model, 2, far=100.0)
    loss = cases.loss_of(few)
    value, slope = cases.weighted(loss, vertices, ground, _reference_path)
    for dtype, tolerance in ((torch.float64, 1e-11), (torch.float32, 1e-5)):
        ours, gradient = cases.weighted(loss, vertices.to(dtype), ground, _device_path)
        assert cases.distance(ours, value) < tolerance
        assert cases.distance(gradient, slope) < tolerance


@inside
@pytest.mark.parametrize("preset", cases.PRESETS)
@pytest.mark.parametrize("curve", cases.CURVES)
def test_the_tiny_body(tiny, preset, curve):
    loss = cases.loss_of(tiny.template, preset, curve)
    value, slope = cases.weighted(loss, tiny.vertices, tiny.ground, _reference_path)
    run = cases.separate if preset == "released" else cases.weighted
    ours, gradient = run(loss, tiny.vertices, tiny.ground, _device_path)
    assert cases.distance(ours, value) < 1e-12
    assert cases.distance(gradient, slope) < 1e-12


@inside
def test_no_neighbour_and_no_position_changes_a_bit(tiny):
    loss = cases.loss_of(tiny.template)
    terms, gradient = cases.weighted(loss, tiny.vertices, tiny.ground, _device_path)
    for body in range(3):
        alone, slope = cases.weighted(loss, tiny.vertices[[body]], tiny.ground, _device_path)
        assert torch.equal(alone[0], terms[body])
        assert torch.equal(slope[0], gradient[body])


@inside
def test_one_part_and_open_edges(tiny):
    old = tiny.template
    for faces in (old.faces, old.faces[1:]):
        template = ip.BodyTemplate(old.vertices, faces, num_samples=100)
        loss = cases.loss_of(template)
        value, slope = cases.weighted(loss, tiny.vertices, tiny.ground, _reference_path)
        ours, gradient = cases.weighted(loss, tiny.vertices, tiny.ground, _device_path)
        assert cases.distance(ours, value) < 1e-12
        assert cases.distance(gradient, slope) < 1e-12


@inside
def test_a_broken_body(tiny):
    cases.check_a_broken_body(tiny)


@inside
def test_no_bodies(tiny):
    cases.check_no_bodies(tiny)


@inside
def test_derivatives(tiny):
    cases.check_derivatives(tiny)


@inside
def test_compile_fullgraph(tiny):
    cases.check_compiled(tiny)


@inside
def test_opcheck(tiny):
    normal, height = tiny.ground.normal.expand(3, 3), tiny.ground.height.expand(3)
    problem = (tiny.template._key, "tanh_squared", [100.0, 10.0, 0.0, 1.0, 0.15, 10.0, 0.15])
    weights = torch.ones(3, 3, dtype=torch.float64)
    utilities = ("test_schema", "test_faketensor")
    torch.library.opcheck(
        torch.ops.ipman_rs.stability_terms.default, (tiny.vertices, normal, height, *problem), test_utils=utilities
    )
    torch.library.opcheck(
        torch.ops.ipman_rs.stability_terms_and_gradient.default, (tiny.vertices, normal, height, weights, *problem)
    )
