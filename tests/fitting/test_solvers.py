"""The solvers, each body alone: against scipy, through walls of NaN, and in company."""

from dataclasses import replace

import numpy as np
import pytest
import scipy.optimize

from ipman_rs.fitting.solvers import SOLVERS, SolverOptions, ValueAndGradient, minimise

TIMES = np.linspace(0, 3, 20)
VALUES = 2 * np.exp(-1.3 * TIMES) + 0.1 * np.cos(9 * TIMES)
STRICT = SolverOptions(iterations=400, gradient=1e-8, decrease=0.0)


def rosenbrock(x):
    """As residuals, so that 2 JᵀJ is a model of the Hessian."""
    r = np.array([10 * (x[1] - x[0] ** 2), 1 - x[0]])
    j = np.array([[-20 * x[0], -1.0], [10.0, 0.0]])
    return ValueAndGradient(float(r @ r), 2 * j @ r, 2 * j @ j.T)


def exponential(x):
    """Residuals of a decay through points; its minimum is known from scipy alone."""
    e = np.exp(-x[1] * TIMES)
    r = x[0] * e - VALUES
    j = np.stack([e, -x[0] * TIMES * e])
    return ValueAndGradient(float(r @ r), 2 * j @ r, 2 * j @ j.T)


def everywhere(function):
    return lambda bodies, points: [function(point) for point in points]


@pytest.mark.parametrize("name", SOLVERS)
def test_rosenbrock(name):
    (outcome,) = minimise(SOLVERS[name], np.array([[-1.2, 1.0]]), everywhere(rosenbrock), STRICT)
    assert outcome.converged
    np.testing.assert_allclose(outcome.point, [1, 1], atol=1e-7)


@pytest.mark.parametrize("name", SOLVERS)
def test_as_scipy(name):
    (outcome,) = minimise(SOLVERS[name], np.array([[1.0, 0.5]]), everywhere(exponential), STRICT)
    expected = scipy.optimize.least_squares(
        lambda x: x[0] * np.exp(-x[1] * TIMES) - VALUES,
        [1.0, 0.5], xtol=1e-15, ftol=1e-15, gtol=1e-15,
    )  # fmt: skip
    np.testing.assert_allclose(outcome.point, expected.x, atol=1e-7)


@pytest.mark.parametrize("name", SOLVERS)
def test_a_step_into_the_undefined_is_undone(name):
    """√x is NaN left of zero, and its slope drives there: the minimum of √x + (x − 2)² / 4 beyond the wall is found."""

    def walled(x):
        with np.errstate(invalid="ignore"):
            root = np.sqrt(x[0] - 1)
        r = np.array([root, x[0] - 1.5])
        j = np.array([[0.5 / root, 1.0]])
        return ValueAndGradient(float(r @ r), 2 * j @ r, 2 * j @ j.T)

    (outcome,) = minimise(SOLVERS[name], np.array([[9.0]]), everywhere(walled), STRICT)
    assert np.isfinite(outcome.value)
    assert outcome.value <= walled(np.array([1.01])).value  # the minimum lies at the wall: x − 1 + (x − 1.5)² at 1


@pytest.mark.parametrize("name", SOLVERS)
def test_an_undefined_start_is_handed_back(name):
    (outcome,) = minimise(
        SOLVERS[name], np.array([[3.0]]), everywhere(lambda x: ValueAndGradient(np.nan, x, np.eye(1))), STRICT
    )
    assert (outcome.reason, outcome.converged, outcome.point) == ("not finite", False, 3.0)


@pytest.mark.parametrize("name", SOLVERS)
def test_a_constant_does_not_fool_the_end(name):
    """A saturated ground term is a constant of thousands: the end must be the same with it."""
    found = [
        minimise(
            SOLVERS[name], np.array([[-1.2, 1.0]]),
            everywhere(lambda x, c=constant: replace(rosenbrock(x), value=rosenbrock(x).value + c)),
            SolverOptions(iterations=400, gradient=1e-5, decrease=1e-9),
        )[0]
        for constant in (0.0, 8192.0)
    ]  # fmt: skip
    np.testing.assert_allclose(
        found[1].point, found[0].point, atol=2e-3
    )  # 8192 has steps of 2e-12: so has the decrease
    assert found[1].converged


@pytest.mark.parametrize("name", SOLVERS)
def test_company_changes_nothing(name):
    """To the bit: alone, beside others, beside one that is broken."""
    starts = np.array([[-1.2, 1.0], [2.0, 2.0], [np.nan, 0.0], [0.3, -0.4]])
    together = minimise(SOLVERS[name], starts, everywhere(rosenbrock), STRICT)
    for start, outcome in zip(starts, together, strict=True):
        (alone,) = minimise(SOLVERS[name], start[None], everywhere(rosenbrock), STRICT)
        assert alone.point.tobytes() == outcome.point.tobytes()
        assert (alone.reason, alone.iterations) == (outcome.reason, outcome.iterations)


@pytest.mark.parametrize("name", SOLVERS)
def test_the_end_of_iterations_is_said(name):
    (outcome,) = minimise(SOLVERS[name], np.array([[-1.2, 1.0]]), everywhere(rosenbrock), SolverOptions(iterations=3))
    assert (outcome.reason, outcome.iterations, outcome.converged) == ("iterations", 3, False)
