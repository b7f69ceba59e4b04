"""Modules that were moved are still found, with a warning."""

from __future__ import annotations

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
