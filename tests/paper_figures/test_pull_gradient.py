"""The gradient of L_pull against its closed form, and what holds of the paper's claim about it."""

from __future__ import annotations

import numpy as np
import pytest

from ipman_rs.paper_figures.pull_gradient import engine_curve

pytestmark = pytest.mark.slow

HEIGHTS = np.linspace(0.0, 0.5, 101)


@pytest.mark.parametrize(("weight", "width"), [(1.0, 0.15), (3.0, 0.5)])
def test_the_engine_s_curve_is_the_closed_form(weight, width):
    """L = α1 tanh²(h/α2), so dL/dh = 2 α1/α2 tanh(h/α2) / cosh²(h/α2); the push below the ground is its mirror."""
    x = HEIGHTS / width
    value, slope = weight * np.tanh(x) ** 2, 2 * weight / width * np.tanh(x) / np.cosh(x) ** 2
    pull, _ = engine_curve(HEIGHTS, alpha1=weight, alpha2=width)
    _, push = engine_curve(-HEIGHTS, beta1=weight, beta2=width)
    np.testing.assert_allclose(pull, (value, slope), rtol=1e-12, atol=1e-14)
    np.testing.assert_allclose(push, (value, -slope), rtol=1e-12, atol=1e-14)
    other, _ = engine_curve(-HEIGHTS[1:])
    assert np.array_equal(other, np.zeros((2, 100)))  # no pull below the ground


def test_the_paper_s_claim(figure, contents):
    said = figure("pull", "--body", "anny-lite")
    assert said.code == 0, said.err
    numbers = said.numbers
    # tanh² = 1/3 at the steepest point: h = 0.15 artanh(1/√3) = 98.8 mm.
    assert numbers["peak_m"] == pytest.approx(0.15 * np.arctanh(1 / np.sqrt(3)))
    assert numbers["peak_gradient_per_m"] == pytest.approx(4 / (3 * np.sqrt(3)) / 0.15, rel=1e-9)
    shares = numbers["share_of_peak"]
    assert {key: round(100 * share) for key, share in shares.items()} == {"0.1": 100, "0.15": 83, "0.2": 55, "0.3": 18}
    assert numbers["claim_holds"] is False
    assert "does not hold" in said.out
    again = figure("pull", "--body", "anny-lite", out="again")
    assert contents(said.folder) == contents(again.folder)
    assert set(contents(said.folder)) == {"pull.png", "pull.svg", "pull.json", "pull.csv"}


def test_a_narrow_pull_would_keep_the_claim(figure):
    """Of a width of 5 cm, tanh(4)/cosh²(4) of the peak 2/(3√3) is left at 20 cm: 0.3 %."""
    said = figure("pull", "--width", "0.05", "--body", "anny-lite")
    assert said.numbers["claim_holds"] is True
    left = np.tanh(4) / np.cosh(4) ** 2 / (2 / (3 * np.sqrt(3)))
    assert said.numbers["share_of_peak"]["0.2"] == pytest.approx(left, rel=1e-3)


@pytest.mark.parametrize(("width", "said"), [(1, "65.8 cm"), (50, "3292.4 cm"), (0.001, "0.1 cm")])
def test_any_width(figure, width, said):
    """The engine's curve is largest where the peak is said to be, and falls below a tenth of it within the heights:
    tanh(x)/cosh²(x) = 0.2/(3√3) at x = 2.3018. Of a wide pull the gradient still grows beyond 20 cm."""
    done = figure("pull", "--width", width, "--body", "anny-lite")
    assert f"largest at {said}" in done.out
    numbers = done.numbers
    rows = np.genfromtxt(done.folder / "pull.csv", delimiter=",", names=True)
    heights, slope = rows["height_m"], rows["pull_gradient_per_m"]
    step = heights[1]
    top = heights[slope.argmax()]
    assert 0 < top < heights[-1]
    assert numbers["peak_m"] == pytest.approx(top, abs=step)
    assert numbers["peak_gradient_per_m"] >= slope.max()
    assert 0 <= numbers["below_a_tenth_of_the_peak_beyond_m"] - 2.3018 * width < step + 1e-4 * width
    assert numbers["claim_holds"] is (width < 0.05)


@pytest.mark.parametrize("arguments", [("--width", 0), ("--push-width", -1), ("--width", "nan"), ("--body", "smpl")])
def test_wrong_usage(arguments, figure):
    said = figure("pull", *arguments)
    assert said.code == 2
    assert arguments[0] in said.err
