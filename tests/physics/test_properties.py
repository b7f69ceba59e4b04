"""What must hold for any body: laws of geometry on random meshes, and that no argument whatever breaks the engine."""

from __future__ import annotations

import contextlib

import numpy as np
import pytest
import trimesh
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp

import ipman_rs as ip
from ipman_rs import _core
from tests.helpers import oracles, solids

# One seed for all machines: a failure is a bug, never luck.
steady = settings(
    max_examples=40, deadline=None, derandomize=True, suppress_health_check=[HealthCheck.function_scoped_fixture]
)
BLOB = solids.blob(subdivisions=1, num_samples=80)


@st.composite
def bodies(draw):
    """The blob bent and shaken: vertices (42, 3) within a metre or so of the ground."""
    rng = np.random.default_rng(draw(st.integers(0, 2**32)))
    bend = np.eye(3) + draw(st.floats(0, 0.3)) * rng.normal(size=(3, 3))
    shaken = BLOB.vertices @ bend + draw(st.floats(0, 0.05)) * rng.normal(size=BLOB.vertices.shape)
    return shaken - [0.0, shaken[:, 1].min() + draw(st.floats(-0.1, 0.1)), 0.0]


@st.composite
def rotations(draw):
    turn = np.linalg.qr(np.random.default_rng(draw(st.integers(0, 2**32))).normal(size=(3, 3)))[0]
    return turn * np.sign(np.linalg.det(turn))


@steady
@given(st.lists(st.integers(0, 5), min_size=80, max_size=80), bodies())
def test_parts_add_up(labels, vertices):
    """Any labels whatever: the signed volumes and first moments of the closed parts add up to the whole body's."""
    labels = np.unique(labels, return_inverse=True)[1]
    template = ip.BodyTemplate(BLOB.vertices, BLOB.faces, labels, num_samples=1)
    solid = ip.mass_properties(vertices, template, 1.0)
    whole = trimesh.Trimesh(vertices, BLOB.faces, process=False)
    scale = np.abs(solid.parts.volume).sum()
    assert solid.parts.volume.sum() == pytest.approx(whole.volume, rel=0, abs=1e-12 * scale)
    solids_only = solid.parts.volume != 0  # a single face can be a part: flat, without a centre
    first = solid.parts.volume[solids_only] @ solid.parts.center[solids_only]
    np.testing.assert_allclose(first, whole.volume * whole.center_mass, rtol=0, atol=1e-11)


@steady
@given(bodies(), rotations(), st.tuples(*[st.floats(-50, 50)] * 3))
def test_a_moved_world_is_the_same_world(vertices, turn, shift):
    """Rotate and shift body and ground alike: numbers stay, points move along, inertia turns."""
    moved = vertices @ turn.T + shift
    here, there = ip.Ground.y_up(), ip.Ground(turn[:, 1], turn[:, 1] @ shift)
    close = {"rtol": 1e-9, "atol": 1e-10}
    np.testing.assert_allclose(ip.part_volumes(moved, BLOB), ip.part_volumes(vertices, BLOB), **close)
    for method in solids.METHODS:
        expected = ip.center_of_mass(vertices, BLOB, method) @ turn.T + shift
        np.testing.assert_allclose(ip.center_of_mass(moved, BLOB, method), expected, **close)
    inertia = ip.mass_properties(vertices, BLOB).inertia
    np.testing.assert_allclose(ip.mass_properties(moved, BLOB).inertia, turn @ inertia @ turn.T, rtol=0, atol=1e-8)
    expected = ip.center_of_pressure(vertices, BLOB, here) @ turn.T + shift
    np.testing.assert_allclose(ip.center_of_pressure(moved, BLOB, there), expected, **close)
    for function in (ip.pressure, ip.stability_loss, ip.ground_loss, ip.balance_cost):
        np.testing.assert_allclose(function(moved, BLOB, there), function(vertices, BLOB, here), rtol=1e-8, atol=1e-9)
    h = ip.Ground().signed_height(oracles.samples(vertices, BLOB))
    if np.abs(np.abs(h) - 0.1).min() > 1e-9:  # the contact set is decided beyond rounding
        np.testing.assert_allclose(
            ip.support_margin(moved, BLOB, there), ip.support_margin(vertices, BLOB, here), rtol=0, atol=1e-9
        )


@steady
@given(bodies(), st.floats(0.01, 100))
def test_scaling(vertices, factor):
    """Lengths scale by s, volumes by s³, inertia at the same density by s⁵; and pressure sees only αh and γh."""
    s = factor
    np.testing.assert_allclose(ip.part_volumes(s * vertices, BLOB), s**3 * ip.part_volumes(vertices, BLOB), rtol=1e-10)
    small, large = ip.mass_properties(vertices, BLOB), ip.mass_properties(s * vertices, BLOB)
    np.testing.assert_allclose(large.inertia, s**5 * small.inertia, rtol=0, atol=1e-9 * s**5)
    ground = ip.Ground()
    np.testing.assert_allclose(
        ip.pressure(s * vertices, BLOB, ground, 100 / s, 10 / s), ip.pressure(vertices, BLOB, ground), rtol=1e-10
    )
    np.testing.assert_allclose(
        ip.stability_loss(s * vertices, BLOB, ground, 100 / s, 10 / s),
        s * ip.stability_loss(vertices, BLOB, ground), rtol=1e-8, atol=1e-10 * s,
    )  # fmt: skip
    np.testing.assert_allclose(
        ip.balance_cost(s * vertices, BLOB, ground, 100 / s, 50 / s, 0.02 * s),
        ip.balance_cost(vertices, BLOB, ground), rtol=1e-6, atol=1e-9,
    )  # fmt: skip
    pull, push = ip.ground_loss(s * vertices, BLOB, ground, alpha2=0.15 * s, beta2=0.15 * s)
    np.testing.assert_allclose((pull, push), ip.ground_loss(vertices, BLOB, ground), rtol=1e-10, atol=1e-12)


@steady
@given(bodies(), st.floats(0.005, 0.5), st.sampled_from(solids.METHODS))
def test_the_margin_is_qhull_s(vertices, threshold, method):
    points = oracles.samples(vertices, BLOB)
    touching = np.abs(points[:, 1]) < threshold
    frame = oracles.frame([0.0, 1.0, 0.0])
    centre = oracles.center_of_mass(vertices, BLOB, method) @ frame.T
    expected = oracles.signed_margin(points[touching] @ frame.T, centre)
    found = ip.base_of_support(vertices, BLOB, ip.Ground(), threshold, method)
    assert found.num_contacts == touching.sum()
    assert found.margin == pytest.approx(expected, abs=1e-11)
    if abs(expected) > 1e-9:
        assert ip.bose(vertices, BLOB, ip.Ground(), threshold, "lp", method) == (expected > 0)


@pytest.mark.slow
@settings(steady, max_examples=200)
@given(st.lists(st.tuples(*[st.integers(-4, 4)] * 2), min_size=1, max_size=40), st.data())
def test_hulls_of_grid_points(grid, data):
    """Duplicates, lines and lattices, where hull codes go wrong. Every tetrahedron of a heap is shrunk into one grid
    point, so the contacts are exactly these points; one corner of the first flies high above the ground, where it moves
    the vertex mean to where we want it."""
    grid = np.array(grid, float) / 8
    target = np.array(data.draw(st.tuples(*[st.integers(-40, 40)] * 2)), float) / 64
    count = len(grid)
    points = np.tile(solids.TETRAHEDRON[0], (count, 1))
    faces = np.concatenate([solids.TETRAHEDRON[1] + 4 * k for k in range(count)])
    template = ip.BodyTemplate(points, faces, num_samples=40 * count, seed=1)
    lifted = np.repeat(np.stack([grid[:, 0], np.zeros(count), grid[:, 1]], axis=1), 4, axis=0)
    lifted[3] = [0.0, 4096.0, 0.0]
    lifted[3, [0, 2]] = target * 4 * count - lifted[:, [0, 2]].sum(axis=0)
    found = ip.base_of_support(lifted, template, ip.Ground(), 2.0**-20, "vertex_mean")
    samples = oracles.samples(lifted, template)
    seen = samples[np.abs(samples[:, 1]) < 2.0**-20][:, [2, 0]]
    assert found.num_contacts == len(seen)
    expected = oracles.signed_margin(seen, lifted.mean(axis=0)[[2, 0]])
    # Touching the boundary is decided either way by the last bit; the distance is not.
    assert abs(found.margin) == pytest.approx(abs(expected), abs=1e-9)
    if abs(expected) > 1e-9:
        assert found.inside == (expected > 0)
        assert ip.bose(lifted, template, ip.Ground(), 2.0**-20, "lp", "vertex_mean") == (expected > 0)


@steady
@given(bodies(), st.permutations(range(6)))
def test_the_order_of_the_batch_is_the_order_of_the_results(vertices, order):
    batch = np.stack([vertices + [0.1 * k, 0, 0] for k in range(6)])
    np.testing.assert_array_equal(
        ip.stability_loss(batch[list(order)], BLOB, ip.Ground()),
        ip.stability_loss(batch, BLOB, ip.Ground())[list(order)],
    )


WORDS = [
    "part_volumes", "mass_properties", "sample_surface", "center_of_mass", "pressure", "center_of_pressure",
    "support_margin", "stability_loss", "ground_loss", "balance_cost", "terms", "stability", "balance", "ground",
    *solids.METHODS, "paper", "released", "samples", "vertices", "tanh_squared", "tanh_of_square", "log", "saturate",
    "none", "", "é",
]  # fmt: skip
GOOD = [
    ("part_volumes", 0), ("mass_properties", 1), ("sample_surface", 0), ("center_of_mass.pcom", 0), ("pressure", 2),
    ("center_of_mass.face_area", 0), ("center_of_mass.exact", 0), ("center_of_pressure", 3),
    ("support_margin.paper.pcom", 1), ("support_margin.released.exact", 1), ("stability_loss.pcom", 3),
    ("ground_loss.samples.tanh_squared", 4), ("ground_loss.vertices.tanh_of_square", 4), ("balance_cost.log.pcom", 3),
    ("balance_cost.none.exact", 3), ("terms.stability.pcom.ground.samples.tanh_squared", 7),
    ("terms.balance.log.pcom.ground.samples.tanh_squared", 7),
]  # fmt: skip
floats = st.one_of(st.floats(), st.sampled_from([0.0, -0.0, 1e-320, 1e-30, 1e30, 1e200, 1e308, -1.0, 1.0, 100.0]))
anything = st.one_of(
    st.none(), st.booleans(), st.integers(), floats, st.text(max_size=4), st.binary(max_size=4),
    st.lists(floats, max_size=3),
    hnp.arrays(
        st.sampled_from([np.float32, np.float64, np.int64, np.float16, bool, ">f8", "c16", "U2"]),
        hnp.array_shapes(min_dims=0, max_dims=4, max_side=3),
    ),
)  # fmt: skip
VERBS = {
    "value": [], "vjp": ["d_out"], "jvp": ["d_vertices"], "hvp": ["d_out", "d_vertices"], "value_and_vjp": ["d_out"],
}  # fmt: skip
TAME = (ValueError, TypeError, OverflowError)


@pytest.mark.slow
@settings(steady, max_examples=1000)
@given(st.data())
def test_no_arguments_break_the_core(data):
    """Right, nearly right and senseless arguments to every entry: an answer, or ValueError, TypeError (OverflowError
    where Python's own conversion of an integer raises it). A RuntimeError would be a caught panic, and a PanicException
    no Exception at all."""
    quantity, count = data.draw(st.sampled_from(GOOD))
    batch = data.draw(st.integers(0, 2))
    dtype = data.draw(st.sampled_from([np.float32, np.float64]))
    vertices = np.repeat(BLOB.vertices[None], batch, axis=0).astype(dtype)
    size = _core.Quantity(BLOB._core, quantity, [1.0] * count).num_outputs
    arguments = {
        "template": BLOB._core,
        "quantity": quantity,
        "options": data.draw(st.lists(floats, min_size=count, max_size=count)),
        "vertices": vertices,
        "normal": np.tile([0.0, 1.0, 0.0], (batch, 1)),
        "height": np.zeros(batch),
        "d_out": np.ones((batch, size), dtype),
        "d_vertices": np.ones_like(vertices),
    }
    verb = data.draw(st.sampled_from(list(VERBS)))
    names = ["template", "quantity", "options", "vertices", "normal", "height", *VERBS[verb]]
    for name in data.draw(st.lists(st.sampled_from(names), max_size=2, unique=True)):
        kind = data.draw(st.sampled_from(["anything", "values", "words"]))
        if kind == "values" and isinstance(arguments[name], np.ndarray) and arguments[name].size:
            spoilt = arguments[name].copy()
            spoilt.flat[data.draw(st.integers(0, spoilt.size - 1))] = data.draw(st.floats(width=32))
            arguments[name] = spoilt
        elif kind == "words" and name == "quantity":
            arguments[name] = ".".join(data.draw(st.lists(st.sampled_from(WORDS), max_size=6)))
        else:
            arguments[name] = data.draw(anything)
    with contextlib.suppress(TAME):
        handle = _core.Quantity(*(arguments[name] for name in names[:3]))
        getattr(handle, verb)(*(arguments[name] for name in names[3:]))


@pytest.mark.slow
@settings(steady, max_examples=200)
@given(st.data())
def test_no_arguments_break_support_and_status(data):
    rule = data.draw(st.one_of(st.sampled_from(["paper", "released"]), anything))
    method = data.draw(st.one_of(st.sampled_from(solids.METHODS), anything))
    threshold = data.draw(st.one_of(floats, anything))
    vertices = BLOB.vertices[None].copy()
    for _ in range(data.draw(st.integers(0, 3))):
        vertices.flat[data.draw(st.integers(0, vertices.size - 1))] = data.draw(floats)
    normal, height = np.array([[data.draw(floats), 1.0, 0.0]]), np.array([data.draw(floats)])
    for call, words in (
        (_core.base_of_support, [rule, method]),
        (_core.bose_lp, [rule, method]),
        (_core.status, [rule]),
    ):
        with contextlib.suppress(TAME):
            call(BLOB._core, *words, threshold, vertices, normal, height)


@pytest.mark.slow
@settings(steady, max_examples=300)
@given(st.data())
def test_no_arguments_break_the_template(data):
    """Spoilt octahedra, faces and labels at random, and things that are none: a template, or an error that says why."""
    points = np.vstack([np.eye(3), -np.eye(3)])
    faces = np.array([[a, b, c] if (a + b + c) % 2 else [a, c, b] for a in (0, 3) for b in (1, 4) for c in (2, 5)])
    labels = data.draw(hnp.arrays(np.int64, 8, elements=st.integers(0, 2)))
    for array, values in ((points, floats), (faces, st.integers(-1, 6)), (labels, st.integers(-1, 9))):
        for _ in range(data.draw(st.integers(0, 2))):
            array.flat[data.draw(st.integers(0, array.size - 1))] = data.draw(values)
    kept = slice(data.draw(st.integers(0, 8)), data.draw(st.integers(0, 8)))
    faces, labels = (faces[kept], labels[kept]) if data.draw(st.booleans()) else (faces, labels)
    points, faces, labels = (data.draw(st.just(x) | anything) for x in (points, faces, labels))
    samples, seed = data.draw(st.integers(-1, 5) | floats), data.draw(st.integers(0, 5) | anything)
    with np.errstate(all="ignore"):
        with contextlib.suppress(ValueError, TypeError):
            ip.BodyTemplate(points, faces, labels, num_samples=samples, seed=seed)
        with contextlib.suppress(TAME):
            _core.Template(points, faces, labels, samples, seed)
