"""Names that were changed or moved are still found, with a warning."""

from __future__ import annotations

import importlib
import subprocess
import sys

import pytest

import ipman_rs.data.keypoints
import ipman_rs.data.markers
from ipman_rs.fitting import detection_problem

MOVED = {"keypoints": ipman_rs.data.keypoints, "markers": ipman_rs.data.markers, "detected": detection_problem}


@pytest.mark.parametrize("name", MOVED)
@pytest.mark.parametrize("words", ["import ipman_rs.fitting.{0}", "from ipman_rs.fitting import {0}"])
def test_moved_modules(name, words):
    """Imported once, in any way, a module warns once."""
    shown = f"print(sys.modules['ipman_rs.fitting.{name}'].__name__)"
    script = f"import warnings, sys; warnings.simplefilter('always'); {words.format(name)}; {shown}"
    done = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == MOVED[name].__name__
    said = [line for line in done.stderr.splitlines() if "DeprecationWarning" in line]
    assert len(said) == 1
    assert f"ipman_rs.fitting.{name} is now {MOVED[name].__name__}" in said[0]


@pytest.mark.parametrize(
    ("module", "old", "now"),
    [
        ("ipman_rs.fitting.detection_problem", "problem", "problem_from_detections"),
        ("ipman_rs.fitting.marker_fit", "Recorded", "MarkerFit"),
        ("ipman_rs.fitting.result", "results", "fit_results"),
        ("ipman_rs.fitting.start", "begin", "initial_state"),
        ("ipman_rs.simulation", "Comparison", "MethodComparison"),
        ("ipman_rs.study", "Camera", "ViewCamera"),
        ("ipman_rs.training.losses", "Physics", "PhysicsLoss"),
    ],
)
def test_changed_names(module, old, now):
    package = importlib.import_module(module)
    with pytest.warns(DeprecationWarning, match=f"{module}.{old} is now {module}.{now}"):
        assert getattr(package, old) is getattr(package, now)
