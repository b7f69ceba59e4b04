"""Bodies that are posed and analysed a piece at a time: the numbers of all at once, to the bit, in flat memory."""

from __future__ import annotations

import dataclasses
import tracemalloc
import warnings

import numpy as np
import pytest

import ipman_rs as ip
from ipman_rs.body.sequence import PosedSequence

COUNT = 70
GROUND = ip.Ground((0.05, 1.0, 0.0), -0.9)


def parameters(count=COUNT, dtype=np.float32):
    """Poses around the T-pose, betas and translations of each; body 33 is NaN."""
    rng = np.random.default_rng(3)
    pose = rng.normal(scale=0.2, size=(count, 24, 3)).astype(dtype)
    if count > 33:
        pose[33, 5] = np.nan
    return pose, rng.normal(size=(count, 10)).astype(dtype), rng.normal(scale=0.1, size=(count, 3)).astype(dtype)


@pytest.fixture(scope="module")
def template(lite):
    return lite.make_template(500)


def figures(found):
    """Every array of an analysis by name."""
    values = {f.name: getattr(found, f.name) for f in dataclasses.fields(found)}
    support = vars(values.pop("base_of_support"))
    return values | {f"support.{name}": value for name, value in support.items()}


def assert_same(ours, theirs):
    ours, theirs = figures(ours), figures(theirs)
    for name in ours.keys() - {"support.polygon"}:
        np.testing.assert_array_equal(ours[name], theirs[name], err_msg=name)
        assert getattr(ours[name], "dtype", None) == getattr(theirs[name], "dtype", None), name
    for our, their in zip(ours["support.polygon"], theirs["support.polygon"], strict=True):
        np.testing.assert_array_equal(our, their)


@pytest.mark.parametrize("piece", [1, 7, 64, 1000])
@pytest.mark.parametrize("dtype", [np.float32, np.float64])
def test_any_piece_gives_the_bits_of_all_at_once(piece, dtype, lite, template):
    pose, betas, transl = parameters(dtype=dtype)
    whole = ip.analyze(lite(pose, betas, transl).vertices, template, GROUND)
    options = {"betas": betas, "transl": transl, "template": template, "piece": piece, "with_pressure": True}
    parts = list(ip.analyze_poses(lite, pose, GROUND, **options))
    assert [len(part.status) for part in parts] == [min(piece, COUNT - start) for start in range(0, COUNT, piece)]
    assert_same(ip.Analysis.concatenate(parts), whole)
    assert whole.status[33] == ip.Status.NON_FINITE
    assert np.isnan(whole.volume).sum() == np.isnan(whole.balance).sum() == 1
    assert whole.pressure_sum.dtype == dtype


def test_one_shape_and_place_for_all(lite, template):
    pose, betas, transl = parameters(20)
    found = ip.Analysis.concatenate(
        ip.analyze_poses(lite, pose, GROUND, betas[0], transl[:1], "released", 900.0, template, piece=6)
    )
    whole = ip.analyze(lite(pose, betas[0], transl[0]).vertices, template, GROUND, "released", 900.0, False)
    assert found.pressure is None
    assert_same(found, whole)


def test_no_bodies_at_all(lite, template):
    (part,) = ip.analyze_poses(lite, np.zeros((0, 24, 3), np.float32), GROUND, template=template)
    assert part.volume.shape == (0,)
    assert part.inertia.shape == (0, 3, 3)
    assert part.base_of_support.polygon == []
    with pytest.raises(ValueError, match="at least one"):
        ip.Analysis.concatenate([])


def test_a_sequence_reads_like_its_vertices(lite):
    pose, betas, transl = parameters(20)
    bodies = PosedSequence.of(lite, pose, betas, transl)
    vertices = lite(pose, betas, transl).vertices
    assert (len(bodies), bodies.shape, bodies.ndim) == (20, vertices.shape, 3)
    for index in (0, -1, np.int64(7), slice(3, 9), slice(None), np.array([4, 4, 19]), np.array([], int)):
        np.testing.assert_array_equal(bodies[index], vertices[index])
    with pytest.raises(IndexError):
        bodies[20]


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"piece": 0}, "piece: expected 1"),
        ({"pose": np.zeros((5, 72))}, "pose: expected"),
        ({"betas": np.zeros((3, 10))}, "betas: expected one row or 5"),
        ({"transl": np.zeros((5, 2))}, "transl: expected"),
        ({"ground": ip.Ground(height=np.zeros(5))}, "ground: expected one"),
        ({"preset": "paper"}, "preset: expected"),
        ({"density": [1.0, 2.0]}, "density: expected"),
    ],
)
def test_bad_input(change, message, lite, template):
    arguments = {"body": lite, "pose": np.zeros((5, 24, 3)), "ground": GROUND, "template": template, **change}
    with pytest.raises(ValueError, match=message):
        list(ip.analyze_poses(**arguments))


def test_units_are_warned_of_once(lite, template):
    pose, betas, transl = parameters(20)
    betas[12:, 0] = 1e4
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        list(ip.analyze_poses(lite, pose, GROUND, betas, transl, template=template, piece=4))
    units = [str(warning.message) for warning in caught if warning.category is ip.UnitsWarning]
    assert len(units) == 1
    assert units[0].startswith("body 12 ")


def test_memory_does_not_grow_with_the_number_of_bodies(lite, template):
    """The vertices of 40 bodies take 0.6 MB, those of 2,000 take 29 MB."""
    peaks = []
    for count in (40, 40, 2000):  # the first makes what is kept
        pose = np.zeros((count, 24, 3), np.float32)
        tracemalloc.start()
        for _ in ip.analyze_poses(lite, pose, GROUND, template=template, piece=32):
            pass
        peaks.append(tracemalloc.get_traced_memory()[1])
        tracemalloc.stop()
    assert peaks[2] < peaks[1] + 0.3e6


def test_of_a_mesh_of_one_part(lite):
    """The exact centre of mass takes the place of the paper's."""
    template = ip.BodyTemplate(lite.template.vertices, lite.faces, num_samples=200)
    pose, _, _ = parameters(5)
    found = ip.Analysis.concatenate(ip.analyze_poses(lite, pose, GROUND, template=template, piece=2))
    assert found.com_method == "exact"
    np.testing.assert_array_equal(found.center_of_mass, found.center_of_mass_exact)
    np.testing.assert_array_equal(found.part_volumes, ip.part_volumes(lite(pose).vertices, template))
