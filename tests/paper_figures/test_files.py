"""What every figure has in common: its files, their bytes, and that nothing heavy is loaded before it is needed."""

from __future__ import annotations

import re
import subprocess
import sys
from importlib import import_module
from pathlib import Path

import numpy as np
import pytest
from matplotlib.figure import Figure
from PIL import Image

from ipman_rs import paper_figures
from ipman_rs.cli.figure import figure as command
from ipman_rs.paper_figures import PaperFigure


def test_every_figure_has_a_command_and_a_module():
    assert set(command.commands) == set(paper_figures.FIGURES)
    for module in paper_figures.FIGURES.values():
        made = import_module(f"ipman_rs.paper_figures.{module}")
        assert callable(getattr(made, module))
    for each in command.commands.values():
        assert "ipman figure" in (each.help or ""), f"{each.name} shows no example"


def drawn(name="curve"):
    picture = Figure(figsize=(2, 1))
    picture.subplots().plot([0, 1], [1, 0], label="a line")
    numbers = {"slope": np.float64(-1), "missing": np.nan, "list": np.arange(3)}
    return PaperFigure(name, picture, numbers, {"x": np.arange(3)}, [{"x": 0, "y": 1}, {"x": 1, "y": 0}])


def test_the_files_of_a_figure(tmp_path, contents):
    written = paper_figures.write(drawn(), tmp_path / "a" / "new")
    assert [path.name for path in written] == ["curve.png", "curve.svg", "curve.json", "curve.npz", "curve.csv"]
    paper_figures.write(drawn(), tmp_path / "b")
    assert contents(tmp_path / "a" / "new") == contents(tmp_path / "b")
    assert Image.open(written[0]).size == (300, 150)
    assert "a line" not in written[1].read_text()  # there is no legend
    assert "<dc:date>" not in written[1].read_text()
    assert '"missing": null' in written[2].read_text()
    assert written[4].read_text() == "x,y\n0,1\n1,0\n"
    with np.load(written[3]) as stored:
        assert stored["x"].tolist() == [0, 1, 2]


def test_the_layout_has_no_digits_of_the_solver(tmp_path):
    """It differs in the last digit from run to run, and so would the names in the SVG."""
    made = drawn()
    made.picture.set_layout_engine("constrained")
    paper_figures.write(made, tmp_path)
    (axes,) = made.picture.axes
    place = np.array(axes.get_position(original=True).bounds)
    np.testing.assert_allclose(place, np.round(place, 9), rtol=0, atol=1e-15)
    assert abs(place[0] - 0.125) > 0.005  # matplotlib's own, without a layout


@pytest.mark.slow
def test_a_folder_that_cannot_be_written(tmp_path, figure):
    (tmp_path / "file").write_text("a file is in the way")
    said = figure("com", "standing", "--body", "anny-lite", out="file/out")
    assert said.code == 1
    assert said.err.count("\n") == 1
    assert "file/out" in said.err


def test_the_library_loads_nothing_heavy():
    script = "import sys, ipman_rs.paper_figures\n"
    script += "print([m for m in ('matplotlib', 'torch', 'sklearn', 'click') if m in sys.modules])"
    done = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"


def test_numbers_of_the_paper_s_figures(figure):
    """Fig. 6 of the published paper is the pressure; the guide's table says the same."""
    docs = (Path(__file__).parents[2] / "docs" / "use" / "figures.md").read_text(encoding="utf-8")
    for name in paper_figures.FIGURES:
        (row,) = (line for line in docs.splitlines() if line.startswith(f"| `{name}` |"))
        numbers = re.findall(r"Fig\. \w+(?:\.\d)?", row)
        assert all(number in figure(name, "--help").out for number in numbers), name


@pytest.mark.parametrize("name", paper_figures.FIGURES)
def test_help(name, figure):
    said = figure(name, "--help")
    assert said.code == 0
    assert f"ipman figure {name}" in said.out
