"""Accumulators: exact whatever the shards, judged by fractions, statistics and numpy; files; bad input."""

from __future__ import annotations

import json
import math
import statistics
import tracemalloc
import zipfile
from fractions import Fraction

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from ipman_rs.evaluation import Accumulator, reasons
from ipman_rs.evaluation.statistics.clusters import CLUSTERS, pooled_clusters
from ipman_rs.evaluation.statistics.exact_sum import LARGEST, exact, limbs

METRICS = ("mpjpe", "bose")


def data(count, sequences, seed=0):
    """Figures of very different sizes, some missing; names; sequences that follow each other."""
    draw = np.random.default_rng(seed)
    sizes = 10.0 ** draw.uniform(-9, 6, count)
    values = {"mpjpe": draw.standard_normal(count) * sizes, "bose": draw.integers(0, 2, count).astype(float)}
    values["mpjpe"][draw.random(count) < 0.1] = np.nan
    groups = np.sort(draw.integers(sequences, size=count))
    return values, np.array([f"frame {i}" for i in range(count)]), np.array([f"sequence {g}" for g in groups])


def of(values, names, sequences, rows):
    found = Accumulator()
    found.add({metric: value[rows] for metric, value in values.items()}, names[rows], sequences[rows], "no truth")
    return found


def merged(parts):
    found = Accumulator()
    for part in parts:
        found.merge(part)
    return found


def file_of(accumulator, folder):
    accumulator.save(folder / "shard.npz")
    return (folder / "shard.npz").read_bytes()


@settings(deadline=None)
@given(st.lists(st.floats(-LARGEST, LARGEST, exclude_min=True, exclude_max=True), min_size=1, max_size=50))
def test_sums_are_those_of_fractions(numbers):
    """Up to the last place of 2⁻⁶⁴, to which each number is rounded."""
    total = exact(limbs(np.array(numbers)).sum(axis=0))
    rounded = sum((Fraction(round(Fraction(x) * 2**64), 2**64) for x in numbers), Fraction())
    assert total == rounded
    assert abs(total - sum(map(Fraction, numbers))) <= Fraction(len(numbers), 2**65)


def test_summary_by_statistics():
    values, names, sequences = data(3000, 17)
    values["mpjpe"] = np.abs(values["mpjpe"]) % 3
    found = of(values, names, sequences, np.arange(3000)).summary()
    for metric in METRICS:
        known = [x for x in values[metric].tolist() if not math.isnan(x)]
        assert found[metric].mean == float(sum(map(Fraction, known)) / len(known))
        assert found[metric].std == pytest.approx(statistics.stdev(known), rel=1e-9)
        assert (found[metric].least, found[metric].largest) == (min(known), max(known))
        assert found[metric].frames == len(known)
        assert found[metric].clusters == 17
    assert found["mpjpe"].missing == {"no truth": int(np.isnan(values["mpjpe"]).sum())}
    assert found["bose"].missing == {}


@pytest.mark.slow
@settings(max_examples=60, deadline=None)
@given(st.data())
def test_any_shards_in_any_order_give_the_same_bits(drawn):
    """Frames dealt at random to shards, each shuffled, added in pieces, merged in any order and nesting."""
    values, names, sequences = data(drawn.draw(st.integers(1, 120)), 9, drawn.draw(st.integers(0, 5)))
    count = len(names)
    whole = of(values, names, sequences, np.arange(count))
    shard_of = np.array(drawn.draw(st.lists(st.integers(0, 6), min_size=count, max_size=count)))
    order = np.array(drawn.draw(st.permutations(range(count))))
    parts = []
    for shard in drawn.draw(st.permutations(range(7))):
        rows = order[shard_of[order] == shard]
        part = Accumulator()
        for piece in np.array_split(rows, 3):
            part.merge(of(values, names, sequences, piece))
        parts.append(part)
    nested = [merged(parts[:3]), merged(parts[3:])]
    for found in (merged(parts), merged(nested[::-1])):
        assert repr(found.summary()) == repr(whole.summary())  # repr: NaN is itself there
        assert repr(found.intervals(resamples=50)) == repr(whole.intervals(resamples=50))


@pytest.mark.parametrize("shards", [1, 2, 7, 50])
@pytest.mark.parametrize("sequences", [30, CLUSTERS - 50, 3 * CLUSTERS])
def test_the_same_file_for_any_number_of_shards(tmp_path, shards, sequences):
    """Also where only the whole has too many sequences to be kept apart, and where shards have, too."""
    values, names, groups = data(4 * CLUSTERS, sequences)
    whole = of(values, names, groups, np.arange(len(names)))
    assert whole.is_pooled == (sequences > CLUSTERS)
    rows = np.random.default_rng(1).permutation(len(names))
    parts = [of(values, names, groups, part) for part in np.array_split(rows, shards)]
    assert file_of(merged(parts), tmp_path) == file_of(whole, tmp_path)


def test_pooled_clusters_are_those_of_the_hash():
    count = CLUSTERS + 100
    values, names, _ = data(count, 1)
    values["bose"] = np.arange(count) / 8  # exact
    found = of(values, names, names, np.arange(count)).clusters("bose")
    which = pooled_clusters(names.tolist())
    assert found.names == [str(cluster) for cluster in np.unique(which)]
    expected = np.bincount(which, values["bose"], CLUSTERS)
    np.testing.assert_array_equal(found.sums, expected[np.unique(which)])
    np.testing.assert_array_equal(found.counts, np.unique(which, return_counts=True)[1])


@pytest.mark.slow
def test_memory_is_flat():
    """A hundred thousand images, each a sequence of its own, in pieces: no more memory than ten thousand."""
    peaks = []
    for count in (10_000, 100_000):
        tracemalloc.start()
        found = Accumulator()
        for start in range(0, count, 2_000):
            names = [f"image {i}" for i in range(start, start + 2_000)]
            found.add({"mpjpe": np.arange(2_000.0), "bose": np.ones(2_000)}, names, names)
        found.summary()
        peaks.append(tracemalloc.get_traced_memory()[1])
        tracemalloc.stop()
    assert peaks[1] < 1.1 * peaks[0]
    assert peaks[1] < 10e6


def test_what_is_missing_and_why():
    values = np.array([1.0, np.nan, np.inf, -np.inf, np.nan, 1e12, 2.0])
    conditions = {"no label": np.arange(7) == 1, "body not finite": np.arange(7) >= 1}
    found = Accumulator()
    found.add({"a": values, "b": values}, list("abcdefg"), ["s"] * 7, {"a": reasons(conditions), "b": "none"})
    found.add({"c": values}, list("hijklmn"), ["s"] * 7)
    found.add({"c": values}, list("opqrstu"), ["s"] * 7, [""] * 7)
    assert found.summary()["a"].missing == {"body not finite": 1, "infinite or over 2^31": 3, "no label": 1}
    assert found.summary()["b"].missing == {"infinite or over 2^31": 3, "none": 2}
    assert found.summary()["c"].missing == {"infinite or over 2^31": 6, "undefined": 4}
    assert found.summary()["a"].mean == 1.5
    assert reasons(conditions).tolist() == ["", "no label", *["body not finite"] * 5]


def test_nothing_at_all():
    found = Accumulator()
    assert found.summary() == {}
    found.add({"a": [], "b": []}, [], [])
    found.add({"a": [np.nan], "b": [3.0]}, ["f"], ["s"])
    nothing, one = found.summary().values()
    assert np.isnan([nothing.mean, nothing.std, nothing.least, nothing.largest]).all()
    assert nothing.frames == nothing.clusters == 0
    assert one[:1] + one[2:] == (3.0, 3.0, 3.0, 1, 1, {})
    assert np.isnan(one.std)
    assert np.isnan(found.intervals()["b"][1:]).all()
    assert np.isnan(found.intervals()["a"]).all()


def test_metrics_that_only_some_shards_have(tmp_path):
    first, second = Accumulator(), Accumulator()
    first.add({"a": [1.0, 2.0]}, ["f", "g"], ["s", "s"])
    second.add({"b": [5.0]}, ["h"], ["t"])
    assert file_of(merged([first, second]), tmp_path) == file_of(merged([second, first]), tmp_path)
    assert {metric: found.mean for metric, found in merged([first, second]).summary().items()} == {"a": 1.5, "b": 5.0}


def test_merging_leaves_the_other_as_it_is(tmp_path):
    values, names, sequences = data(50, 5)
    other = of(values, names, sequences, np.arange(50))
    before = file_of(other, tmp_path)
    found = merged([other])
    found.add({"bose": [1.0]}, ["another"], ["sequence 0"])
    found.pooled()
    assert file_of(other, tmp_path) == before


@pytest.mark.parametrize("sequences", [1, 40, 2 * CLUSTERS])
def test_files(tmp_path, sequences):
    values, names, groups = data(3 * CLUSTERS, sequences)
    found = of(values, names, groups, np.arange(len(names)))
    before = file_of(found, tmp_path)
    loaded = Accumulator.load(tmp_path / "shard.npz")
    assert repr(loaded.summary()) == repr(found.summary())
    assert file_of(loaded, tmp_path) == before
    more = of(*data(10, 2, seed=9), np.arange(10))
    loaded.merge(more)
    found.merge(more)
    assert file_of(loaded, tmp_path) == file_of(found, tmp_path)
    assert [path.name for path in tmp_path.iterdir()] == ["shard.npz"]


def test_an_empty_file(tmp_path):
    Accumulator().save(tmp_path / "shard.npz")
    assert Accumulator.load(tmp_path / "shard.npz").summary() == {}


def loads(path):
    try:
        return repr(Accumulator.load(path).summary())
    except ValueError as error:
        return "no" if "no accumulator can be read from it" in str(error) else str(error)


def test_damaged_files(tmp_path):
    path = tmp_path / "shard.npz"
    found = of(*data(50, 5), np.arange(50))
    whole = file_of(found, tmp_path)
    advice = "shard.npz: no accumulator can be read from it.*if it is a shard's, run that shard again"
    for end in (0, 10, len(whole) // 2, len(whole) - 30):
        path.write_bytes(whole[:end])
        with pytest.raises(ValueError, match=advice):
            Accumulator.load(path)
    for place in range(100, len(whole), 97):
        path.write_bytes(whole[:place] + bytes([whole[place] ^ 255]) + whole[place + 1 :])
        assert loads(path) in {"no", repr(found.summary())}
    path.unlink()
    with pytest.raises(ValueError, match=advice):
        Accumulator.load(path)


def forged(path, **changes):
    """The file with other arrays in it; `head` as what is to be changed in it."""
    with np.load(path) as file:
        arrays = {name: file[name] for name in file.files}
    head = json.loads(arrays["head"].tobytes()) | changes.pop("head", {})
    arrays |= {"head": np.frombuffer(json.dumps(head).encode(), np.uint8)} | changes
    np.savez(path, **arrays)


@pytest.mark.parametrize(
    "change",
    [
        {"head": {"format": "ipman_rs accumulator 2"}},
        {"head": {"metrics": ["one"]}},
        {"head": {"metrics": ["one", "two", "three"]}},
        {"head": {"sequences": ["too few"]}},
        {"head": {"sequences": ["the same"] * 5}},
        {"head": {"sequences": 7}},
        {"head": {"metrics": ["one"], "missing": [{}]}},
        {"head": {"missing": [{"a": "b"}, {}]}},
        {"head": {"missing": [{"a": -1}, {}]}},
        {"sums": np.zeros((2, 5, 4))},
        {"counts": np.full((2, 5), -1)},
        {"counts": np.zeros((2, 5), "O")},
        {"edges": np.zeros(0)},
    ],
)
def test_forged_files(tmp_path, change):
    path = tmp_path / "shard.npz"
    of(*data(50, 5), np.arange(50)).save(path)
    forged(path, **change)
    with pytest.raises(ValueError, match="no accumulator can be read from it"):
        Accumulator.load(path)


def test_other_files(tmp_path):
    path = tmp_path / "other.npz"
    np.savez(path, a=np.zeros(3))
    with pytest.raises(ValueError, match="no accumulator can be read from it"):
        Accumulator.load(path)
    with zipfile.ZipFile(path, "w") as archive:
        archive.writestr("head.npy", b"cos\nsystem\n(S'true'\ntR.")
    with pytest.raises(ValueError, match="no accumulator can be read from it"):
        Accumulator.load(path)


def test_bad_input_adds_nothing(tmp_path):
    found = of(*data(50, 5), np.arange(50))
    before = file_of(found, tmp_path)
    with pytest.raises(ValueError, match="sequences: expected a name per frame, 2, got 3"):
        found.add({"a": [1.0, 2.0]}, ["f", "g"], ["s"] * 3)
    with pytest.raises(ValueError, match=r"b: expected a number per frame, \(2,\), got \(3,\)"):
        found.add({"a": [1.0, 2.0], "b": [1.0, 2.0, 3.0]}, ["f", "g"], ["new", "new"])
    with pytest.raises(ValueError, match=r"why: expected a word or a word per frame, \(2,\), got \(3,\)"):
        found.add({"a": [1.0, np.nan]}, ["f", "g"], ["new", "new"], ["x"] * 3)
    with pytest.raises(ValueError, match="metric: expected one of bose, mpjpe, got 'pve'"):
        found.clusters("pve")
    assert file_of(found, tmp_path) == before
