"""What numpy users pass: lists, strides, byte orders, precisions, batch dimensions; and what they get back."""

from __future__ import annotations

import copy

import numpy as np
import pytest

import ipman_rs as ip
from tests.helpers import solids

every = pytest.mark.parametrize("name", solids.EVERY)


def call(name, vertices, template, ground=None):
    return [np.asarray(result) for result in solids.EVERY[name](vertices, template, ground or ip.Ground())]


def same_bits(results, expected):
    for result, wanted in zip(results, expected, strict=True):
        assert result.dtype == wanted.dtype
        np.testing.assert_array_equal(result, wanted)


def strided(array):
    wide = np.empty((array.shape[0], array.shape[1] * 2, 5), array.dtype)
    view = wide[:, ::2, 1:4]
    view[...] = array
    assert not view.flags.c_contiguous
    return view


def read_only(array):
    array = array.copy()
    array.setflags(write=False)
    return array


def unaligned(array):
    buffer = np.empty(array.nbytes + 1, np.uint8)
    view = buffer[1:].view(array.dtype).reshape(array.shape)
    view[...] = array
    assert not view.flags.aligned
    return view


class Subclass(np.ndarray):
    pass


LAYOUTS = {
    "list": lambda a: a.tolist(),
    "tuple of arrays": tuple,
    "strided": strided,
    "backwards": lambda a: a[::-1, ::-1, ::-1].copy()[::-1, ::-1, ::-1],
    "fortran": np.asfortranarray,
    "big-endian": lambda a: a.astype(a.dtype.newbyteorder(">")),
    "read-only": read_only,
    "unaligned": unaligned,
    "subclass": lambda a: a.view(Subclass),
    "memoryview": lambda a: memoryview(np.ascontiguousarray(a)),
}


@pytest.mark.parametrize("layout", LAYOUTS)
@every
def test_layouts_make_no_difference(name, layout, blob, bodies):
    same_bits(call(name, LAYOUTS[layout](bodies), blob), call(name, bodies, blob))


def test_big_endian_single_precision_stays_single(blob, bodies):
    single = bodies.astype(np.float32)
    got = ip.part_volumes(single.astype(">f4"), blob)
    assert got.dtype == np.float32
    assert got.dtype.isnative
    np.testing.assert_array_equal(got, ip.part_volumes(single, blob))


@pytest.mark.parametrize(
    ("given", "expected"),
    [("f4", "f4"), ("f8", "f8"), ("f2", "f4"), ("i2", "f8"), ("i8", "f8"), ("u4", "f8"), (np.longdouble, "f8")],
)
@every
def test_dtype_of_the_input_decides(name, given, expected, blob, bodies):
    """float32 stays, half is computed and returned in float32, everything else becomes float64."""
    whole_metres = np.round(np.abs(bodies) * 4)
    vertices = whole_metres.astype(given)
    results = call(name, vertices, blob)
    same_bits(results, call(name, whole_metres.astype(expected), blob))
    for result in results:
        assert result.dtype in {np.dtype(expected), np.dtype(np.int64), np.dtype(bool)}


# What single precision may lose, relative to the body of about 2 m, 100 kg: positions 1e-6 m, and 1e-5 of the rest.
@every
def test_single_precision_is_close_to_double(name, blob, bodies):
    single = bodies.astype(np.float32)
    for low, high in zip(call(name, single, blob), call(name, single.astype(np.float64), blob), strict=True):
        np.testing.assert_allclose(low, high, rtol=2e-5, atol=2e-6)


@pytest.mark.parametrize("shape", [(), (1,), (6,), (2, 3), (3, 1, 2), (1, 1, 1, 6)])
@every
def test_batch_dimensions_are_free(name, shape, blob, bodies):
    count = int(np.prod(shape))
    vertices = bodies[:count].reshape(*shape, blob.num_vertices, 3)
    flat = call(name, bodies[:count], blob)
    for result, wanted in zip(call(name, vertices, blob), flat, strict=True):
        assert result.shape == (*shape, *wanted.shape[1:])
        np.testing.assert_array_equal(result, wanted.reshape(result.shape))


@pytest.mark.parametrize("shape", [(0,), (2, 0), (0, 3), (2, 0, 3)])
@every
def test_no_bodies_at_all(name, shape, blob, bodies):
    one = call(name, bodies[:1], blob)
    for result, wanted in zip(call(name, np.zeros((*shape, blob.num_vertices, 3)), blob), one, strict=True):
        assert result.shape == (*shape, *wanted.shape[1:])
        assert result.dtype == wanted.dtype


def test_no_bodies_but_a_ground_for_each(blob):
    none = np.zeros((0, blob.num_vertices, 3), np.float32)
    ground = ip.Ground(np.zeros((0, 3)), np.zeros(0))
    assert ip.stability_loss(none, blob, ground).shape == (0,)
    assert ip.stability_loss(none, blob, ground).dtype == np.float32
    assert ip.base_of_support(none, blob, ground).polygon == []


def test_grounds_broadcast_over_batches(blob, bodies):
    batch = bodies.reshape(2, 3, blob.num_vertices, 3)
    heights = np.array([-0.1, 0.0, 0.1])
    got = ip.stability_loss(batch, blob, ip.Ground(height=heights))
    for row in range(2):
        for column in range(3):
            alone = ip.stability_loss(batch[row, column], blob, ip.Ground(height=heights[column]))
            assert got[row, column] == alone


def test_one_body_gives_scalars(blob, bodies):
    """As numpy's own reductions do: a float that prints, formats and indexes dictionaries like one."""
    for name in ("support_margin", "bose-hull", "stability_loss", "ground_loss-samples", "balance_cost", "bose-lp"):
        for result in solids.EVERY[name](bodies[0], blob, ip.Ground()):
            assert isinstance(result, (np.floating, np.bool_)), name
    found = ip.base_of_support(bodies[0], blob, ip.Ground())
    assert f"{float(found.area):.3f} {bool(found.inside)} {int(found.num_contacts)}"
    solid = ip.mass_properties(bodies[0], blob)
    assert f"{solid.mass:.1f} {solid.volume:.4f}"


@every
def test_outputs_never_alias_inputs(name, blob, bodies):
    for dtype in (np.float32, np.float64):
        vertices = np.array(bodies, dtype)
        before = vertices.copy()
        results = call(name, vertices, blob)
        expected = copy.deepcopy(results)
        for result in results:
            assert not np.shares_memory(result, vertices)
        np.testing.assert_array_equal(vertices, before)
        vertices[...] = 0.0
        same_bits(results, expected)


def test_results_may_be_written(blob, bodies):
    first = ip.sample_surface(bodies, blob)
    second = ip.sample_surface(bodies, blob)
    first += 1.0
    np.testing.assert_array_equal(second + 1.0, first)


@every
def test_place_in_the_batch_makes_no_difference(name, blob, bodies):
    order = np.array([5, 0, 3, 3, 1, 2, 4])
    shuffled = call(name, bodies[order], blob)
    alone = [call(name, bodies[[index]], blob) for index in range(6)]
    for place, index in enumerate(order):
        for many, one in zip(shuffled, alone[index], strict=True):
            np.testing.assert_array_equal(many[place], one[0])


@pytest.mark.parametrize("bad", [np.nan, np.inf, -np.inf])
@pytest.mark.parametrize("dtype", [np.float32, np.float64])
@every
def test_a_bad_body_stays_alone(name, bad, dtype, blob, bodies):
    """NaN or inf in one coordinate: its results are NaN (False, 0, NON_FINITE where there is no NaN), the others' bits
    do not change."""
    good = bodies.astype(dtype)
    broken = good.copy()
    broken[2, 17, 1] = bad
    others = [0, 1, 3, 4, 5]
    for result, wanted in zip(call(name, broken, blob), call(name, good, blob), strict=True):
        np.testing.assert_array_equal(result[others], wanted[others])
        if result.dtype.kind == "f":
            assert np.isnan(result[2]).all()
        elif name == "body_status":
            assert result[2] == ip.Status.NON_FINITE
        else:
            assert not result[2].any()


@pytest.mark.parametrize("scale", [0.0, 1e-200, 1e-30, 1e30, 1e200])
@every
def test_absurd_sizes_raise_nothing(name, scale, blob, bodies):
    for dtype in (np.float32, np.float64):
        with np.errstate(over="ignore"):
            vertices = (bodies * scale).astype(dtype)
        for result in call(name, vertices, blob):
            assert result.shape[0] == 6


@pytest.mark.parametrize("lift", [100.0, -1.0, 1e6, -1e6])
@pytest.mark.parametrize("dtype", [np.float32, np.float64])
@every
def test_hovering_and_sunk_bodies_are_finite(name, dtype, lift, blob, bodies):
    """All but the margin of a body without contact, which is minus infinity by definition."""
    for result in call(name, (bodies + [0.0, lift, 0.0]).astype(dtype), blob):
        assert not np.isnan(result).any()
        assert np.isfinite(result).all() or name in {"base_of_support", "support_margin"}
