"""The template: what a surface must be, what it is told about, and what may be done with the object."""

from __future__ import annotations

import copy
import pickle
import warnings

import numpy as np
import pytest
import trimesh

import ipman_rs as ip
from ipman_rs.template import by_key
from tests.helpers import solids

NAN, INF = float("nan"), float("inf")
POINTS, FACES = solids.TETRAHEDRON


def replaced(array, at, value):
    array = np.array(array)
    array[at] = value
    return array


def two_tetrahedra_on_an_edge():
    """Two solids that touch along one edge, at which four faces meet."""
    other = POINTS.copy()
    other[[2, 3]] *= -1.0
    points = np.vstack([POINTS, other[2:]])
    return points, np.vstack([FACES, np.array([[0, 4, 1], [0, 1, 5], [1, 4, 5], [4, 0, 5]])])


# name: (arguments that differ from a tetrahedron's, error, words)
BAD = {
    "no faces": ({"faces": np.zeros((0, 3), int)}, ValueError, ["faces", "at least one"]),
    "empty list of faces": ({"faces": []}, ValueError, ["faces", "(0,)"]),
    "quads": ({"faces": [[0, 1, 2, 3]]}, ValueError, ["faces", "(n, 3)", "(1, 4)"]),
    "faces of rank 1": ({"faces": FACES.ravel()}, ValueError, ["faces", "(n, 3)", "(12,)"]),
    "faces of rank 3": ({"faces": FACES[None]}, ValueError, ["faces", "(1, 4, 3)"]),
    "index out of range": ({"faces": replaced(FACES, (2, 1), 4)}, ValueError, ["face 2", "vertex 4", "0 to 3"]),
    "negative index": ({"faces": replaced(FACES, (3, 2), -1)}, ValueError, ["faces", "face 3", "-1"]),
    "huge index": ({"faces": replaced(FACES, (0, 0), 2**62)}, ValueError, ["faces", "face 0", str(2**62)]),
    "index that wraps": ({"faces": replaced(FACES, (0, 0), 2**32)}, ValueError, ["faces", str(2**32)]),
    "huge unsigned index": ({"faces": replaced(FACES.astype("u8"), (0, 0), 2**63)}, ValueError, ["faces", str(2**63)]),
    "float faces": ({"faces": FACES.astype(float)}, TypeError, ["faces", "integers", "float64"]),
    "bool faces": ({"faces": FACES > 0}, TypeError, ["faces", "bool"]),
    "masked faces": ({"faces": np.ma.masked_array(FACES)}, TypeError, ["faces", "masked"]),
    "no faces at all": ({"faces": None}, TypeError, ["faces"]),
    "repeated vertex": ({"faces": replaced(FACES, 1, [0, 3, 3])}, ValueError, ["faces", "face 1", "vertex 3", "twice"]),
    "duplicated face": ({"faces": np.vstack([FACES, FACES[1:2]])}, ValueError, ["face 4", "repeats", "face 1"]),
    "duplicated turned face": ({"faces": np.vstack([FACES, [[1, 3, 0]]])}, ValueError, ["face 4", "repeats", "face 1"]),
    "one flipped face": ({"faces": replaced(FACES, 2, FACES[2, ::-1])}, ValueError, ["same direction", "orient"]),
    "inside out": ({"faces": FACES[:, ::-1]}, ValueError, ["faces", "inside out", "[:, ::-1]"]),
    "mirrored vertices": ({"vertices": POINTS * [-1, 1, 1]}, ValueError, ["inside out"]),
    "flat": ({"vertices": POINTS * [1, 1, 0]}, ValueError, ["vertices", "no volume"]),
    "one point": ({"vertices": POINTS * 0.0}, ValueError, ["vertices", "no volume"]),
    "a flat sheet": ({"faces": FACES[:1]}, ValueError, ["no volume", "sheet"]),
    "non-manifold edge": (
        dict(zip(("vertices", "faces"), two_tetrahedra_on_an_edge(), strict=True)),
        ValueError, ["faces", "(0, 1)", "4 faces", "non-manifold"],
    ),
    "three faces at an edge": (
        {"vertices": np.vstack([POINTS, [[0, -1, -1]]]), "faces": np.vstack([FACES, [[0, 1, 4]]])},
        ValueError, ["(0, 1)", "3 faces"],
    ),
    "NaN vertex": ({"vertices": replaced(POINTS, (2, 1), NAN)}, ValueError, ["vertices", "finite", "vertex 2"]),
    "inf vertex": ({"vertices": replaced(POINTS, (3, 0), -INF)}, ValueError, ["vertices", "finite", "vertex 3"]),
    "planar vertices": ({"vertices": POINTS[:, :2]}, ValueError, ["vertices", "(n, 3)", "(4, 2)"]),
    "a batch of vertices": ({"vertices": POINTS[None]}, ValueError, ["vertices", "(n, 3)", "(1, 4, 3)"]),
    "no vertices": ({"vertices": []}, ValueError, ["vertices", "(0,)"]),
    "no vertex": ({"vertices": np.zeros((0, 3))}, ValueError, ["0 vertices"]),
    "masked vertices": ({"vertices": np.ma.masked_array(POINTS)}, TypeError, ["vertices", "masked"]),
    "complex vertices": ({"vertices": POINTS.astype(complex)}, TypeError, ["vertices", "complex128"]),
    "object vertices": ({"vertices": POINTS.astype(object)}, TypeError, ["vertices", "object"]),
    "text": ({"vertices": "body.obj"}, TypeError, ["vertices"]),
    "ragged vertices": ({"vertices": [[0, 0, 0], [1]]}, ValueError, ["vertices", "regular"]),
    "a part with no faces": ({"face_parts": [0, 0, 2, 2]}, ValueError, ["face_parts", "part 1", "no faces"]),
    "parts from one": ({"face_parts": [1, 1, 1, 1]}, ValueError, ["face_parts", "part 0", "no faces"]),
    "negative part": ({"face_parts": [0, 0, -1, 0]}, ValueError, ["face_parts", "face 2", "-1"]),
    "huge part": ({"face_parts": [0, 0, 0, 2**62]}, ValueError, ["face_parts", "face 3"]),
    "too few labels": ({"face_parts": [0, 0, 0]}, ValueError, ["face_parts", "(4,)", "(3,)"]),
    "labels of vertices": ({"face_parts": [[0], [0], [0], [0]]}, ValueError, ["face_parts", "(4, 1)"]),
    "no labels": ({"face_parts": []}, ValueError, ["face_parts", "(4,)", "(0,)"]),
    "float labels": ({"face_parts": [0.0, 0, 0, 0]}, TypeError, ["face_parts", "integers"]),
    "masked labels": ({"face_parts": np.ma.masked_array([0, 0, 0, 0])}, TypeError, ["face_parts", "masked"]),
    "named labels": ({"face_parts": ["head"] * 4}, TypeError, ["face_parts"]),
    "too many names": ({"part_names": ["a", "b"]}, ValueError, ["part_names", "1 names"]),
    "no names": ({"part_names": []}, ValueError, ["part_names", "1 names"]),
    "one word as names": ({"part_names": "b"}, TypeError, ["part_names", "'b'"]),
    "no samples": ({"num_samples": 0}, ValueError, ["num_samples", "1 to", "0"]),
    "negative samples": ({"num_samples": -1}, ValueError, ["num_samples", "-1"]),
    "too many samples": ({"num_samples": 10**9}, ValueError, ["num_samples", str(10**9)]),
    "astronomic samples": ({"num_samples": 2**70}, ValueError, ["num_samples"]),
    "half a sample": ({"num_samples": 1.5}, TypeError, ["num_samples", "1.5"]),
    "samples in words": ({"num_samples": "many"}, TypeError, ["num_samples", "many"]),
    "true samples": ({"num_samples": True}, TypeError, ["num_samples", "True"]),
    "negative seed": ({"seed": -1}, ValueError, ["seed", "-1"]),
    "too large seed": ({"seed": 2**64}, ValueError, ["seed", str(2**64)]),
    "no seed": ({"seed": None}, TypeError, ["seed", "None"]),
    "fractional seed": ({"seed": 0.5}, TypeError, ["seed", "0.5"]),
    "generator as seed": ({"seed": np.random.default_rng(0)}, TypeError, ["seed"]),
}  # fmt: skip


@pytest.mark.parametrize("case", BAD)
def test_bad_templates(case):
    arguments, error, words = BAD[case]
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        with pytest.raises(error) as caught:
            ip.BodyTemplate(**{"vertices": POINTS, "faces": FACES, "num_samples": 10} | arguments)
    assert type(caught.value) is error
    for word in words:
        assert word in str(caught.value), f"{word!r} is not in {str(caught.value)!r}"


@pytest.mark.parametrize("names", [5, 1.5])
def test_names_must_be_a_sequence(names):
    with pytest.raises(TypeError, match="part_names"):
        ip.BodyTemplate(POINTS, FACES, part_names=names)


def test_an_open_mesh_is_told():
    assert ip.BodyTemplate(POINTS, FACES).watertight
    opened = ip.BodyTemplate(POINTS, FACES[:3])
    assert not opened.watertight
    assert "open" in repr(opened)
    # The missing face is the slanted one or a wall; either way the fan to its three corners' mean is the face itself.
    assert ip.mass_properties(POINTS, opened).volume == pytest.approx(1 / 6, rel=1e-14)


def test_every_rim_has_a_centre_of_its_own():
    """A tube open at both ends: the two fans are the prism's two lids."""
    tube = trimesh.creation.cylinder(radius=0.3, height=1.0, sections=24)
    vertices, faces = np.array(tube.vertices), np.array(tube.faces)
    wall = np.ptp(vertices[faces][..., 2], axis=1) > 0.5
    template = ip.BodyTemplate(vertices, faces[wall], num_samples=10)
    assert not template.watertight
    assert ip.mass_properties(vertices, template).volume == pytest.approx(tube.volume, rel=1e-12)


def test_unused_vertices_are_kept():
    """Points that no face uses (as SMPL-X has) move with the rest and change nothing but vertex means."""
    extra = np.vstack([POINTS, [[9.0, 9.0, 9.0]]])
    with_extra, without = ip.BodyTemplate(extra, FACES, num_samples=50), ip.BodyTemplate(POINTS, FACES, num_samples=50)
    assert with_extra.num_vertices == 5
    np.testing.assert_array_equal(ip.sample_surface(extra, with_extra), ip.sample_surface(POINTS, without))
    np.testing.assert_array_equal(
        ip.center_of_mass(extra, with_extra, "exact"), ip.center_of_mass(POINTS, without, "exact")
    )


def test_attributes(anny):
    template = anny.template
    assert (template.num_vertices, template.num_faces) == (12272, 24540)
    assert (template.num_parts, template.num_samples) == (10, 20_000)
    assert template.vertices.shape == (12272, 3)
    assert template.faces.shape == (24540, 3)
    assert template.faces.dtype == template.face_parts.dtype == np.int64
    assert template.part_names == anny.part_names
    assert len(template.part_names) == 10
    assert template.watertight
    assert template.sample_faces.shape == template.sample_parts.shape == (20_000,)
    for word in ("12272 vertices", "24540 faces", "10 parts", "20000 samples"):
        assert word in repr(template)


@pytest.mark.parametrize("dtype", ["i4", "u1", "u8", ">i8", "i2"])
def test_faces_of_any_integer_type(dtype, blob):
    template = ip.BodyTemplate(
        blob.vertices.astype("f4"), blob.faces.astype(dtype), blob.face_parts.astype(dtype), num_samples=300, seed=3
    )
    np.testing.assert_array_equal(template.faces, blob.faces)
    assert template.vertices.dtype == np.float64
    np.testing.assert_array_equal(template.sample_faces, blob.sample_faces)


def test_lists_are_enough():
    template = ip.BodyTemplate(POINTS.tolist(), FACES.tolist(), [0, 0, 1, 1], ["lower", "upper"], num_samples=7)
    assert template.part_names == ("lower", "upper")
    assert template.num_parts == 2


def test_names_may_come_from_an_array():
    names = np.array(["lower", "upper"])
    assert ip.BodyTemplate(POINTS, FACES, [0, 0, 1, 1], names, num_samples=1).part_names == ("lower", "upper")


def test_default_names():
    assert ip.BodyTemplate(POINTS, FACES, num_samples=1).part_names == ("body",)
    assert ip.BodyTemplate(POINTS, FACES, [0, 1, 1, 0], num_samples=1).part_names == ("part_0", "part_1")


def test_the_template_keeps_its_own_copy():
    vertices, faces, parts = POINTS.copy(), FACES.copy(), np.zeros(4, int)
    template = ip.BodyTemplate(vertices, faces, parts, num_samples=10)
    vertices[...], faces[...], parts[...] = 7.0, 0, 9
    np.testing.assert_array_equal(template.vertices, POINTS)
    np.testing.assert_array_equal(template.faces, FACES)
    for array in (template.vertices, template.faces, template.face_parts):
        with pytest.raises(ValueError, match="read-only"):
            array[0] = 0


@pytest.mark.parametrize(
    "duplicate",
    [copy.copy, copy.deepcopy, *(lambda t, p=p: pickle.loads(pickle.dumps(t, p)) for p in (0, 2, 5))],
    ids=["copy", "deepcopy", "pickle-0", "pickle-2", "pickle-5"],
)
def test_copies_compute_the_same_bits(duplicate, blob, bodies):
    other = duplicate(blob)
    assert other._key != blob._key
    assert by_key(other._key) is other
    assert other.part_names == blob.part_names
    for name, function in solids.EVERY.items():
        for a, b in zip(function(bodies, other, ip.Ground()), function(bodies, blob, ip.Ground()), strict=True):
            np.testing.assert_array_equal(a, b, err_msg=name)


def test_grounds_are_pickled_too():
    ground = pickle.loads(pickle.dumps(ip.Ground([1, 2, 3], 0.5)))
    np.testing.assert_array_equal(ground.normal, ip.Ground([1, 2, 3]).normal)
    assert ground.height == 0.5


def test_a_dead_template_is_told():
    key = ip.BodyTemplate(POINTS, FACES, num_samples=1)._key
    with pytest.raises(ValueError, match="does not live"):
        by_key(key)
