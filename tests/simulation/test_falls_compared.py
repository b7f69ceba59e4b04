"""Two methods on the same bodies: shares and displacements, intervals against scipy's, what cannot be compared."""

from __future__ import annotations

import numpy as np
import pytest
import scipy.stats
from scipy.spatial.transform import Rotation

import ipman_rs as ip
from ipman_rs.simulation import FALLEN, Simulation, compare, simulate
from tests.helpers import solids

FLOOR = ip.Ground.y_up()


def made(displacement, tilt, times=(100 / 240, 2.0)):
    """A simulation that ended like this; displacement and tilt (n, T)."""
    displacement, tilt = np.asarray(displacement, float), np.asarray(tilt, float)
    count = len(displacement)
    nothing = np.zeros((count, len(times), 3))
    return Simulation(
        engine="rapier", times=np.array(times), status=np.zeros(count, np.int64), center_of_mass=np.zeros((count, 3)),
        start=np.zeros((count, 3)), center=nothing, rotation=np.zeros((count, len(times), 3, 3)),
        displacement=displacement, tilt=tilt,
    )  # fmt: skip


def two_methods(count):
    """B moves twice as far as A, but for noise, and falls more often."""
    draw = np.random.default_rng(3)
    common = draw.lognormal(-3, 1, (count, 2))
    first, second = common * draw.lognormal(0, 0.3, common.shape), 2 * common * draw.lognormal(0, 0.3, common.shape)
    fell = [np.where(draw.uniform(size=(count, 2)) < share, 1.0, 0.0) for share in (0.2, 0.5)]
    return made(first, fell[0]), made(second, fell[1])


def test_means_and_intervals():
    """Percentile intervals of scipy.stats.bootstrap, to a tenth of their width: both are drawn 10,000 times."""
    first, second = two_methods(200)
    found = compare(first, second)
    assert (found.bodies, found.left_out) == (200, 0)
    pairs = [(found.displacement[k], first.displacement[:, k], second.displacement[:, k]) for k in (0, 1)]
    stands = [(run.tilt[:, -1] <= FALLEN).astype(float) for run in (first, second)]
    for means, one, other in [*pairs, (found.stable, *stands)]:
        assert (means.first, means.second) == pytest.approx((one.mean(), other.mean()))
        assert means.difference.mean == pytest.approx(one.mean() - other.mean())
        assert means.ratio.mean == pytest.approx(one.mean() / other.mean())
        for interval, statistic in (
            (means.difference, lambda a, b, axis: a.mean(axis) - b.mean(axis)),
            (means.ratio, lambda a, b, axis: a.mean(axis) / b.mean(axis)),
        ):
            judge = scipy.stats.bootstrap(
                (one, other), statistic, paired=True, vectorized=True, n_resamples=5000, method="percentile", rng=5
            ).confidence_interval
            assert interval[1:] == pytest.approx((judge.low, judge.high), abs=0.1 * (judge.high - judge.low))
    assert found.stable.difference.low > 0  # A stands more often
    assert found.displacement[1].ratio.high < 1


@pytest.mark.slow
def test_order_of_the_methods_and_many_bodies():
    """Exchanged, differences change sign and ratios are turned over. More than 4,096 bodies are drawn in clusters."""
    first, second = two_methods(6000)
    found, back = compare(first, second, resamples=2000), compare(second, first, resamples=2000)
    for one, other in zip(found.displacement, back.displacement, strict=True):
        assert one.difference.mean == pytest.approx(-other.difference.mean)
        assert one.ratio.low == pytest.approx(1 / other.ratio.high, rel=1e-9)
    standard = np.std(first.displacement[:, 0] - second.displacement[:, 0]) / np.sqrt(6000)
    width = found.displacement[0].difference.high - found.displacement[0].difference.low
    assert width == pytest.approx(2 * 1.96 * standard, rel=0.05)


def test_boxes_that_stand_against_boxes_that_fall():
    vertices, faces = solids.box((0.4, 1.6, 0.6))
    template = ip.BodyTemplate(vertices, faces, num_samples=10)
    bodies = []
    for angle in (0.0, 0.0, 0.3):  # it falls beyond atan(0.4 / 1.6) = 0.245
        turned = Rotation.from_rotvec([0.0, 0.0, angle]).apply(vertices)
        bodies.append(turned - [0.0, turned[:, 1].min(), 0.0])
    steady = simulate(np.stack([bodies[0], bodies[1], bodies[0]]), template, FLOOR)
    shaky = simulate(np.stack(bodies), template, FLOOR)
    found = compare(steady, shaky)
    assert (found.stable.first, found.stable.second) == pytest.approx((1.0, 2 / 3))
    assert found.stable.ratio.mean == pytest.approx(1.5)
    assert found.displacement[1].second > 0.2
    assert found.displacement[1].first < 1e-3


def test_no_verdict_no_share_and_no_number_no_interval():
    early = made([[0.1], [0.2]], [[0.0], [0.0]], times=(100 / 240,))
    found = compare(early, early)
    assert found.stable is None
    assert found.displacement[0].ratio == pytest.approx((1.0, 1.0, 1.0))
    nobody_stands = made([[0.1, 1.0]] * 3, [[0.1, 1.0]] * 3)
    stable = compare(nobody_stands, nobody_stands).stable
    assert stable.difference == (0.0, 0.0, 0.0)
    assert np.isnan(stable.ratio).all()
    alone = compare(made([[0.1, 1.0]], [[0.1, 1.0]]), made([[0.2, 1.0]], [[0.1, 1.0]])).displacement[0]
    assert alone.ratio.mean == pytest.approx(0.5)
    assert np.isnan([alone.ratio.low, alone.difference.high]).all()


def test_bodies_that_one_method_lacks_are_left_out_for_both():
    first = made([[0.1, 0.1], [np.nan, np.nan], [0.3, 0.3]], [[0.0, 0.0], [np.nan, np.nan], [0.0, 1.0]])
    second = made([[0.2, 0.2], [0.9, 0.9], [0.2, 0.2]], [[0.0, 0.0], [1.0, 1.0], [0.0, 0.0]])
    found = compare(first, second)
    assert (found.bodies, found.left_out) == (2, 1)
    assert found.displacement[0].second == pytest.approx(0.2)
    assert (found.stable.first, found.stable.second) == (0.5, 1.0)


def test_what_cannot_be_compared_is_named():
    two = made([[0.1, 0.1]] * 2, [[0.0, 0.0]] * 2)
    with pytest.raises(ValueError, match=r"second: expected a body for each of the first's \(2,\), got \(1,\)"):
        compare(two, made([[0.1, 0.1]], [[0.0, 0.0]]))
    with pytest.raises(ValueError, match="second: expected the first's times"):
        compare(two, made([[0.1, 0.1]] * 2, [[0.0, 0.0]] * 2, times=(0.4, 2.0)))
    unknown = made([[np.nan, np.nan]] * 2, [[np.nan, np.nan]] * 2)
    with pytest.raises(ValueError, match="expected a body that both simulated, got none of 2"):
        compare(two, unknown)
