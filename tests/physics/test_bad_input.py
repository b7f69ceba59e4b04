"""Every kind of bad input to the functions: the type of the error, and that its words name what is wrong.

Bad templates are in test_template.py, bad bodies inside a good batch in test_arrays.py."""

from __future__ import annotations

import warnings

import numpy as np
import pytest

import ipman_rs as ip
from tests.helpers import solids

NAN, INF = float("nan"), float("inf")
every = pytest.mark.parametrize("name", solids.EVERY)


def refused(error, words, function, *args, **kwargs):
    """The call raises exactly this kind of error with all these words, and warns of nothing."""
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        with pytest.raises(error) as caught:
            function(*args, **kwargs)
    assert type(caught.value) is error
    for word in words:
        assert word in str(caught.value), f"{word!r} is not in {str(caught.value)!r}"


BAD_VERTICES = {
    "wrong rank": (lambda v: v[0, :, 0], ValueError, ["vertices", "(..., 162, 3)", "(162,)"]),
    "a number": (lambda v: 1.0, ValueError, ["vertices", "(..., 162, 3)", "()"]),
    "wrong last dimension": (lambda v: v[..., :2], ValueError, ["vertices", "(..., 162, 3)", "(6, 162, 2)"]),
    "four coordinates": (lambda v: v[..., [0, 1, 2, 2]], ValueError, ["vertices", "(6, 162, 4)"]),
    "another body": (lambda v: v[:, :100], ValueError, ["vertices", "162", "(6, 100, 3)"]),
    "swapped axes": (lambda v: v.swapaxes(1, 2), ValueError, ["vertices", "(6, 3, 162)", "swapped"]),
    "flattened": (lambda v: v.reshape(6, -1), ValueError, ["vertices", "(6, 486)"]),
    "empty list": (lambda v: [], ValueError, ["vertices", "(0,)"]),
    "empty lists": (lambda v: [[], []], ValueError, ["vertices", "(2, 0)"]),
    "no vertices": (lambda v: v[:, :0], ValueError, ["vertices", "(6, 0, 3)"]),
    "ragged": (lambda v: [[1.0, 2.0, 3.0], [1.0]], ValueError, ["vertices", "regular"]),
    "masked": (lambda v: np.ma.masked_greater(v, 0.5), TypeError, ["vertices", "masked"]),
    "masked without a mask": (np.ma.masked_array, TypeError, ["vertices", "masked"]),
    "list of masked": (lambda v: [np.ma.masked_greater(x, 0.5) for x in v], TypeError, ["vertices", "masked"]),
    "complex": (lambda v: v.astype(complex), TypeError, ["vertices", "complex128"]),
    "bool": (lambda v: v > 0, TypeError, ["vertices", "bool"]),
    "text": (lambda v: v.astype(str), TypeError, ["vertices", "<U32"]),
    "objects": (lambda v: v.astype(object), TypeError, ["vertices", "object"]),
    "dates": (lambda v: v.astype("datetime64[s]"), TypeError, ["vertices", "datetime64"]),
    "None": (lambda v: None, TypeError, ["vertices"]),
    "a word": (lambda v: "standing", TypeError, ["vertices"]),
    "a dictionary": (lambda v: {"vertices": v}, TypeError, ["vertices"]),
}


@pytest.mark.parametrize("case", BAD_VERTICES)
@every
def test_bad_vertices(name, case, blob, bodies):
    make, error, words = BAD_VERTICES[case]
    refused(error, words, solids.EVERY[name], make(bodies), blob, ip.Ground())


BAD_GROUNDS = {
    "zero normal": ({"normal": [0, 0, 0]}, ValueError, ["ground normal", "zero"]),
    "one zero normal": ({"normal": [[0, 1, 0], [0, 0, 0]]}, ValueError, ["ground normal", "zero"]),
    "NaN normal": ({"normal": [0, NAN, 0]}, ValueError, ["ground normal", "finite"]),
    "inf normal": ({"normal": [0, INF, 0]}, ValueError, ["ground normal", "finite"]),
    "flat normal": ({"normal": [0, 1]}, ValueError, ["ground normal", "(..., 3)", "(2,)"]),
    "a number as normal": ({"normal": 1.0}, ValueError, ["ground normal", "()"]),
    "empty normal": ({"normal": []}, ValueError, ["ground normal", "(0,)"]),
    "word as normal": ({"normal": "y"}, TypeError, ["ground normal"]),
    "no normal": ({"normal": None}, TypeError, ["ground normal"]),
    "masked normal": ({"normal": np.ma.masked_array([0, 1, 0])}, TypeError, ["ground normal", "masked"]),
    "complex normal": ({"normal": [0, 1j, 0]}, TypeError, ["ground normal", "complex"]),
    "NaN height": ({"height": NAN}, ValueError, ["ground height", "finite"]),
    "inf in heights": ({"height": [0.0, INF]}, ValueError, ["ground height", "finite"]),
    "word as height": ({"height": "0"}, TypeError, ["ground height"]),
    "no height": ({"height": None}, TypeError, ["ground height"]),
    "ragged heights": ({"height": [[0.0], [0.0, 1.0]]}, ValueError, ["ground height", "regular"]),
}


@pytest.mark.parametrize("case", BAD_GROUNDS)
def test_bad_grounds(case):
    arguments, error, words = BAD_GROUNDS[case]
    refused(error, words, ip.Ground, **arguments)


@pytest.mark.parametrize(
    ("shape", "ground"),
    [
        ((6,), ip.Ground(height=np.zeros(5))),
        ((6,), ip.Ground(np.ones((4, 3)))),
        ((6,), ip.Ground(height=np.zeros((6, 1)))),
        ((6,), ip.Ground(np.ones((2, 6, 3)))),
        ((), ip.Ground(height=np.zeros(1))),
        ((2, 3), ip.Ground(height=np.zeros(2))),
        ((6,), ip.Ground(np.ones((6, 3)), np.zeros(5))),
    ],
)
def test_grounds_that_do_not_fit_the_batch(shape, ground, blob, bodies):
    vertices = bodies[: int(np.prod(shape))].reshape(*shape, blob.num_vertices, 3)
    for name in ("pressure", "base_of_support", "bose-lp", "body_status"):
        refused(ValueError, ["ground", str(shape), "one for each body"], solids.EVERY[name], vertices, blob, ground)


@pytest.mark.parametrize("ground", [None, (0, 1, 0), 0.0, "y"])
def test_a_ground_must_be_a_ground(ground, blob, bodies):
    for function in (ip.pressure, ip.center_of_pressure, ip.base_of_support, ip.support_margin, ip.bose,
                     ip.stability_loss, ip.ground_loss, ip.balance_cost, ip.body_status, ip.analyze):  # fmt: skip
        refused(TypeError, ["ground", type(ground).__name__], function, bodies, blob, ground)


@pytest.mark.parametrize("template", [None, "anny", 3])
def test_a_template_must_be_a_template(template, bodies):
    for function in (ip.part_volumes, ip.mass_properties, ip.sample_surface, ip.center_of_mass):
        refused(TypeError, ["template", type(template).__name__], function, bodies, template)
    refused(TypeError, ["template", type(template).__name__], ip.analyze, bodies, template, ip.Ground())


OPTIONS = [
    *((ip.pressure, option) for option in ("alpha", "gamma")),
    *((ip.center_of_pressure, option) for option in ("alpha", "gamma", "epsilon")),
    *((ip.stability_loss, option) for option in ("alpha", "gamma", "epsilon")),
    *((ip.ground_loss, option) for option in ("alpha1", "alpha2", "beta1", "beta2")),
    *((ip.balance_cost, option) for option in ("alpha", "gamma", "sigma")),
    *((function, "threshold") for function in (ip.base_of_support, ip.support_margin, ip.bose, ip.body_status)),
]


@pytest.mark.parametrize(("function", "option"), OPTIONS, ids=lambda x: getattr(x, "__name__", x))
def test_options_must_be_finite_numbers(function, option, blob, bodies):
    for value in (NAN, INF, -INF):
        refused(ValueError, [option], function, bodies, blob, ip.Ground(), **{option: value})
    for value in ("1", None, [1.0, 2.0], np.ones(2), 1j):
        refused(TypeError, [option], function, bodies, blob, ip.Ground(), **{option: value})


@pytest.mark.parametrize(
    ("function", "option"),
    [case for case in OPTIONS if case[1] in {"threshold", "alpha2", "beta2", "sigma"}],
    ids=lambda x: getattr(x, "__name__", x),
)
def test_lengths_must_be_positive(function, option, blob, bodies):
    for value in (0.0, -0.1, -0.0):
        refused(ValueError, [option, "positive"], function, bodies, blob, ip.Ground(), **{option: value})


@pytest.mark.parametrize("function", [ip.center_of_pressure, ip.stability_loss])
def test_epsilon_must_not_be_negative(function, blob, bodies):
    refused(ValueError, ["epsilon"], function, bodies, blob, ip.Ground(), epsilon=-1e-6)


@pytest.mark.parametrize("value", ["x", "", "PCOM", "pcom.pcom", None, 3, ["log"]])
def test_choices_are_listed(value, blob, bodies):
    """Every choice by name; a wrong one is answered by the list."""
    on_ground = (bodies, blob, ip.Ground())
    masses = ["method", "pcom", "vertex_mean", "sample_mean", "face_area", "exact"]
    rules = ["contact", "paper", "released"]
    refused(ValueError, masses, ip.center_of_mass, bodies, blob, value)
    for function in (ip.stability_loss, ip.balance_cost, ip.base_of_support, ip.support_margin):
        refused(ValueError, masses, function, *on_ground, method=value)
    refused(ValueError, masses[1:], ip.bose, *on_ground, com_method=value)
    refused(ValueError, ["method", "hull", "lp"], ip.bose, *on_ground, method=value)
    for function in (ip.base_of_support, ip.support_margin, ip.bose, ip.body_status):
        refused(ValueError, rules, function, *on_ground, contact=value)
    refused(ValueError, ["points", "samples", "vertices"], ip.ground_loss, *on_ground, points=value)
    refused(ValueError, ["curve", "tanh_squared", "tanh_of_square"], ip.ground_loss, *on_ground, curve=value)
    refused(ValueError, ["wrap", "log", "saturate", "none"], ip.balance_cost, *on_ground, wrap=value)
    refused(ValueError, ["preset", *ip.presets.PRESETS], ip.analyze, *on_ground, preset=value)
    refused(ValueError, ["preset", *ip.presets.PRESETS], ip.presets.get, value)


@pytest.mark.parametrize(
    ("density", "error"),
    [(0.0, ValueError), (-985.0, ValueError), (NAN, ValueError), (INF, ValueError), ([1.0, 2.0, 3.0], ValueError),
     ([985.0] * 3 + [NAN], ValueError), ([], ValueError), ([[985.0] * 4], ValueError), ("water", TypeError),
     (None, TypeError), (np.ma.masked_array([985.0] * 4), TypeError)],
)  # fmt: skip
def test_densities(density, error, blob, bodies):
    for function, arguments in ((ip.mass_properties, (bodies, blob)), (ip.analyze, (bodies, blob, ip.Ground()))):
        refused(error, ["density"], function, *arguments, density=density)


@pytest.mark.parametrize(
    ("unit", "per_metre"), [("millimetres", 1000.0), ("centimetres", 100.0), ("inches", 1 / 0.0254)]
)
def test_units_are_guessed(unit, per_metre, anny):
    """A body of 1.7 m in another unit: the warning names it and the factor, for the template and for posed bodies."""
    vertices = ip.body.posed(anny, "standing")
    with pytest.warns(ip.UnitsWarning, match=f"{unit}.*{1 / per_metre:g}"):
        template = ip.BodyTemplate(vertices * per_metre, anny.faces, num_samples=10)
    with pytest.warns(ip.UnitsWarning, match=unit):
        ip.analyze(vertices * per_metre, template, ip.Ground())
    assert ip.body_status(vertices * per_metre, template, ip.Ground()) & ip.Status.ODD_SIZE


def test_only_the_odd_body_is_named(blob, bodies):
    mixed = bodies.copy()
    mixed[4] *= 1000
    with pytest.warns(ip.UnitsWarning, match="body 4.*millimetres") as caught:
        found = ip.analyze(mixed, blob, ip.Ground())
    assert len(caught) == 1
    assert (np.flatnonzero(found.status & ip.Status.ODD_SIZE) == [4]).all()


def test_people_in_metres_are_not_warned_of(anny, random_people):
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        people = random_people(anny, 8, seed=3)
        found = ip.analyze(people, anny.make_template(100), ip.Ground())
    assert not (found.status & ip.Status.ODD_SIZE).any()


@pytest.mark.parametrize("value", [0, -1, 2**70])
def test_numbers_of_threads(value):
    before = ip.get_num_threads()
    with pytest.raises(ValueError, match="thread"):
        ip.set_num_threads(value)
    assert ip.get_num_threads() == before


@pytest.mark.parametrize("value", ["two", 1.5, [2]])
def test_threads_are_whole_numbers(value):
    with pytest.raises((TypeError, ValueError), match="thread"):
        ip.set_num_threads(value)


def test_a_body_without_volume_has_no_exact_centre(blob):
    """Flat bodies have status NO_VOLUME and NaN where one divides by the volume; the rest stays finite."""
    flat = blob.vertices * [1.0, 1.0, 0.0]
    ground = ip.Ground()
    assert ip.body_status(flat, blob, ground) & ip.Status.NO_VOLUME
    assert np.isnan(ip.center_of_mass(flat, blob, "exact")).all()
    assert np.isfinite(ip.center_of_mass(flat, blob, "sample_mean")).all()
    assert np.isfinite(ip.center_of_pressure(flat, blob, ground)).all()
