"""Intervals against what is known of means, and against scipy; the sign-flip test against scipy's permutation test."""

from __future__ import annotations

import numpy as np
import pytest
from scipy import stats

from ipman_rs.evaluation import Accumulator, bootstrap, compare, paired, paired_test, sign_flip
from ipman_rs.evaluation.statistics.clusters import CLUSTERS


@pytest.fixture
def draw():
    return np.random.default_rng(0)


def frames(count):
    return [f"frame {i}" for i in range(count)]


def test_paired_interval(draw):
    """Of a normal sample it is mean ± 1.96 standard errors, within a few per cent; pairing removes what is common."""
    common, own = 100 * draw.standard_normal(400), draw.standard_normal(400)
    found = paired(common + own + 0.5, common)
    error = own.std() / 20
    assert found.mean == pytest.approx(0.5 + own.mean())
    assert found.low == pytest.approx(found.mean - 1.96 * error, abs=0.1 * error)
    assert found.high == pytest.approx(found.mean + 1.96 * error, abs=0.1 * error)
    assert found.excludes_zero
    assert found == paired(common + own + 0.5, common)
    assert not paired(own - own.mean(), np.zeros(400)).excludes_zero


def test_interval_is_scipys(draw):
    """Percentiles of drawn means; scipy draws others, so the ends agree to what 50,000 of them leave to chance."""
    values = draw.gamma(1.0, size=60)
    theirs = stats.bootstrap((values,), np.mean, n_resamples=50_000, method="percentile", rng=draw).confidence_interval
    ours = paired(values, np.zeros(60), resamples=50_000)
    np.testing.assert_allclose(ours[1:], theirs, atol=0.02 * (theirs.high - theirs.low))


def test_interval_by_loops(draw):
    """The same draws, sequence by sequence in plain Python."""
    sums, counts = draw.standard_normal(6), draw.integers(1, 9, 6)
    means = []
    for row in np.random.default_rng(4).integers(6, size=(500, 6)).tolist():
        means.append(sum(sums[i] for i in row) / sum(counts[i] for i in row))
    found = bootstrap(sums, counts, 1.25, 0.9, 500, seed=4)
    assert found == pytest.approx((1.25, np.quantile(means, 0.05), np.quantile(means, 0.95)), rel=1e-9)


def test_sequences_are_drawn_whole(draw):
    """Frames of a sequence that are all alike are worth one: the width is that of the sequences' means."""
    means = draw.standard_normal(200)
    values, sequences = np.repeat(means, 30), np.repeat([f"s{i}" for i in range(200)], 30)
    found = paired(values, np.zeros(6000), sequences=sequences)
    alone = paired(means, np.zeros(200))
    assert found.high - found.low == pytest.approx(alone.high - alone.low, rel=0.05)
    assert found.mean == pytest.approx(alone.mean)
    naive = paired(values[:4000], np.zeros(4000))
    assert found.high - found.low > 4 * (naive.high - naive.low)


def test_intervals_hold_what_they_promise(draw):
    """95 % of the intervals hold the true mean: of 300, at 40 sequences, between 90 and 98 % (percentiles of few are a
    little narrow; chance is 1.3 % here)."""
    held = 0
    for _ in range(300):
        sizes = draw.integers(1, 20, 40)
        values = np.repeat(draw.standard_normal(40), sizes) + draw.standard_normal(sizes.sum())
        low, high = paired(values, 0 * values, resamples=600, sequences=np.repeat(np.arange(40), sizes))[1:]
        held += low <= 0 <= high
    assert 0.90 <= held / 300 <= 0.98


def test_a_million_images_in_4096_clusters(draw):
    """Pooling by chance leaves the width what it is for independent images: 2 · 1.96 standard errors, to a few %."""
    count = 20 * CLUSTERS
    values = draw.standard_normal(count)
    found = paired(values, np.zeros(count), resamples=2000)
    assert found.high - found.low == pytest.approx(2 * 1.96 / np.sqrt(count), rel=0.08)
    accumulator = Accumulator()
    accumulator.add({"a": values}, frames(count), frames(count))
    low, high = accumulator.intervals(resamples=2000)["a"][1:]
    assert high - low == pytest.approx(2 * 1.96 / np.sqrt(count), rel=0.08)


def test_intervals_of_an_accumulator_are_those_of_its_frames(draw):
    values, sequences = draw.standard_normal(300), np.repeat(list("abcdefghij"), 30)
    accumulator = Accumulator()
    accumulator.add({"a": values}, frames(300), sequences)
    found, expected = accumulator.intervals(level=0.8)["a"], paired(values, 0 * values, 0.8, sequences=sequences)
    np.testing.assert_allclose(found, expected, rtol=1e-12)


def test_bodies_without_a_figure_count_in_neither(draw):
    values, baseline = draw.standard_normal((2, 50))
    known = np.arange(50) >= 5
    spoilt = np.where(known, values, np.nan), baseline
    assert paired(*spoilt) == paired(values[known], baseline[known])
    assert paired(spoilt[1], spoilt[0]) == paired(baseline[known], values[known])
    assert paired_test(*spoilt) == paired_test(values[known], baseline[known])


def test_sign_flip_is_scipys_sign_flip(draw):
    """With few sequences, from all choices of signs: exactly; ties, too."""
    for values in (draw.standard_normal(9) + 0.7, np.array([1.0, 1.0, -1.0, 2.0, 3.0]), np.zeros(3)):
        zeros = np.zeros(len(values))
        theirs = stats.permutation_test(
            (values, zeros), lambda a, b, axis: np.mean(a - b, axis=axis), permutation_type="samples", vectorized=True
        )
        assert paired_test(values, zeros) == pytest.approx(theirs.pvalue, rel=1e-9)
    assert paired_test([1.0], [0.0]) == 1.0  # one sequence shows nothing


def test_drawn_signs(draw):
    """With many sequences p is drawn, within 1 % of the t-test's here; and never 0."""
    values = draw.standard_normal(200)
    for shift in (0.0, 0.1, 0.2):
        theirs = stats.ttest_1samp(values - values.mean() + shift, 0).pvalue
        assert sign_flip(values - values.mean() + shift) == pytest.approx(theirs, abs=0.015)
    assert sign_flip(values + 10) == 1 / 10_001


def test_p_is_even_where_methods_are_equal(draw):
    """Under no difference p is uniform: Kolmogorov and Smirnov see nothing in 400."""
    found = [sign_flip(draw.standard_normal(8) * draw.gamma(1.0, size=8), seed=seed) for seed in range(400)]
    assert stats.kstest(found, "uniform").pvalue > 0.01


def methods(draw, count=600, sequences=20):
    values, groups = (
        draw.standard_normal((2, count)),
        np.repeat([f"s{i}" for i in range(sequences)], count // sequences),
    )
    values[0] += 0.1
    both = Accumulator(), Accumulator()
    for accumulator, each in zip(both, values, strict=True):
        accumulator.add({"a": each, "own " + str(accumulator is both[0]): each}, frames(count), groups)
    return both, values, groups


def test_comparison_is_that_of_the_frames(draw):
    both, values, groups = methods(draw)
    found = compare(*both)
    assert list(found) == ["a"]
    np.testing.assert_allclose(found["a"].difference, paired(*values, sequences=groups), rtol=1e-9)
    assert found["a"].p == paired_test(*values, sequences=groups)
    assert found["a"][2:] == (600, 20, 0)
    assert compare(*both[::-1])["a"].difference.mean == -found["a"].difference.mean


def test_sequences_with_other_frames_are_left_out(draw):
    """One method fails on a frame, has another frame instead of one, and has a sequence of its own."""
    (first, _), values, groups = methods(draw)
    spoilt, names, second = values[1].copy(), frames(600), Accumulator()
    spoilt[5], names[40] = np.nan, "another frame"
    second.add({"a": spoilt}, names, groups)
    second.add({"a": [100.0]}, ["more"], ["more"])
    found, rest = compare(first, second)["a"], np.arange(600) >= 60
    np.testing.assert_allclose(found.difference, paired(*values[:, rest], sequences=groups[rest]), rtol=1e-9)
    assert found[2:] == (540, 18, 3)


def test_comparison_of_images(draw):
    """One method has one image more, so many that they are pooled."""
    count = CLUSTERS + 1
    values, both = draw.standard_normal((2, count)), (Accumulator(), Accumulator())
    values[0] += 0.1
    for accumulator, each, number in zip(both, values, (count, count - 1), strict=True):
        accumulator.add({"a": each[:number]}, frames(count)[:number], frames(count)[:number])
    assert both[0].is_pooled
    assert not both[1].is_pooled
    found = compare(*both)["a"]
    assert found.left_out == 1
    assert count - 10 < found.frames < count
    assert found.difference.mean == pytest.approx((values[0] - values[1]).mean(), abs=0.005)
    assert found.difference.high - found.difference.low == pytest.approx(
        2 * 1.96 * (values[0] - values[1]).std() / np.sqrt(count), rel=0.08
    )


def test_nothing_in_common(draw):
    (first, _), *_ = methods(draw)
    second = Accumulator()
    second.add({"a": [1.0]}, ["f"], ["another"])
    found = compare(first, second)["a"]
    assert np.isnan([*found.difference, found.p]).all()
    assert found[2:] == (0, 0, 21)
    assert compare(first, Accumulator()) == {}


def test_bad_input():
    with pytest.raises(ValueError, match="of one length"):
        paired(np.zeros(3), np.zeros(4))
    with pytest.raises(ValueError, match="of one length"):
        paired([], [])
    with pytest.raises(ValueError, match="expected a body where both are finite, got none"):
        paired_test([np.nan, 1.0], [1.0, np.nan])
    with pytest.raises(ValueError, match=r"sequences: expected a name per value, \(2,\), got \(3,\)"):
        paired([1.0, 2.0], [1.0, 2.0], sequences=["a"] * 3)
    with pytest.raises(ValueError, match="level: expected a share between 0 and 1, got 95"):
        paired([1.0, 2.0], [1.0, 2.0], level=95)
