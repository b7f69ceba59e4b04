"""Every example runs as its docstring says and prints what it promises; so do the snippets of the README."""

from __future__ import annotations

import importlib.util
import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[1]
EXAMPLES = sorted((ROOT / "examples").glob("*.py"))
SNIPPETS = re.findall(r"```python\n(.*?)```", (ROOT / "README.md").read_text(), re.DOTALL)


def run(code: list[str], source: str) -> str:
    """Standard output of a script in a process of its own, as a user would start it."""
    if "torch" in source and importlib.util.find_spec("torch") is None:
        pytest.skip("needs torch, which is an extra")
    if "import lightning" in source and importlib.util.find_spec("lightning") is None:
        pytest.skip("needs lightning, which is an extra")
    done = subprocess.run(
        [sys.executable, "-W", "error::DeprecationWarning:__main__", *code],
        cwd=ROOT, env={**os.environ, "OMP_NUM_THREADS": "1"}, capture_output=True, text=True, timeout=300, check=False,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    return done.stdout


def example(number: int) -> str:
    (path,) = (ROOT / "examples").glob(f"{number:02d}_*.py")
    return run([str(path)], path.read_text())


def numbers(pattern: str, text: str) -> list[float]:
    return [float(number) for number in re.findall(pattern, text)]


@pytest.mark.slow
def test_analyze_a_body():
    shown = example(1)
    (litres,) = numbers(r"tree: ([\d.]+) litres", shown)
    assert sum(numbers(r"([\d.]+) l\n", shown)) == pytest.approx(litres, abs=0.05)  # ten figures rounded to 5 ml
    margins = numbers(r"margin +([+-]\d+) mm, (?:stands|falls)", shown)
    assert margins[0] > 0 > margins[-1], "a body on one leg stands, and no longer when it leans by 25 degrees"


@pytest.mark.slow
def test_train_with_physics():
    shown = example(2)
    tilt, lowest, margin = (
        numbers(pattern, shown) for pattern in (r"tilt +([\d.]+)", r"point +([+-]\d+)", r"margin +([+-]\d+)")
    )
    assert tilt[0] > 20 > 5 > tilt[-1], "the body comes upright"
    assert lowest[0] > 50 > abs(lowest[-1]), "and down on the floor"
    assert margin[0] < 0 < margin[-1], "and stands"


@pytest.mark.slow
def test_your_own_mesh():
    parts, whole = re.findall(r"([\d.]+) l\b", example(3))
    assert parts == whole, "the parts add up to the volume that trimesh finds"


@pytest.mark.slow
def test_balance_and_gradients():
    shown = example(4)
    predicted, done = numbers(r"([+-][\d.]+) um", shown)
    assert done == pytest.approx(predicted, rel=0.05)  # second order: 1e-4 rad of a curvature of a few metres
    assert len(re.findall(r"^pitch", shown, re.MULTILINE)) == 7
    first, cross, cross_again, second = numbers(r"-?\d+\.\d+", shown.splitlines()[-1])
    assert cross == cross_again
    assert min(first, first * second - cross**2) > 0, "balance is a minimum: the Hessian is positive definite"


@pytest.mark.slow
def test_physics_in_your_trainer():
    shown = example(5)
    errors, costs = numbers(r"off by (\d+)", shown), numbers(r"cost ([\d.]+)", shown)
    assert costs[1] < 0.7 * costs[0], "labels that lean are followed less"
    assert errors[0] < errors[1] < errors[0] + 30, "at some cost"


@pytest.mark.parametrize("path", EXAMPLES, ids=lambda path: path.stem)
def test_under_a_page(path):
    assert len(path.read_text().splitlines()) <= 60


@pytest.mark.slow
@pytest.mark.parametrize("snippet", SNIPPETS, ids=range(len(SNIPPETS)))
def test_readme(snippet):
    run(["-c", snippet], snippet)
