"""Volumes, centres of mass and inertia against trimesh and closed forms.

trimesh integrates in double precision about the world's origin, so two right answers differ by a few roundings of sums
over up to 36,000 faces: 1e-10 of the value is generous for them and far below any error of a formula.
"""

from __future__ import annotations

import numpy as np
import pytest
import trimesh

import ipman_rs as ip
from tests.helpers import oracles, solids

ROUNDING = 1e-10


def agrees_with_trimesh(solid, mesh, density=1.0):
    mesh.density = density
    size = mesh.scale  # the centre may pass through zero, so its error is measured against the body
    assert solid.volume == pytest.approx(mesh.volume, rel=ROUNDING)
    assert solid.mass == pytest.approx(mesh.mass, rel=ROUNDING)
    np.testing.assert_allclose(solid.center, mesh.center_mass, rtol=0, atol=ROUNDING * size)
    np.testing.assert_allclose(solid.inertia, mesh.moment_inertia, rtol=0, atol=ROUNDING * abs(solid.mass) * size**2)


@pytest.mark.parametrize("pose", ip.body.poses.NAMES)
@pytest.mark.parametrize("name", ["anny", "anny-lite"])
def test_named_poses(name, pose, request):
    body = request.getfixturevalue("anny" if name == "anny" else "lite")
    vertices = ip.body.posed(body, pose)
    solid = ip.mass_properties(vertices, body.template)
    agrees_with_trimesh(solid, trimesh.Trimesh(vertices, body.faces, process=False), 985.0)
    np.testing.assert_allclose(ip.center_of_mass(vertices, body.template, "exact"), solid.center, rtol=0, atol=1e-13)


@pytest.mark.slow
@pytest.mark.parametrize("name", ["anny", "lite"])
def test_random_people_whole_and_part_by_part(name, request, random_people):
    body = request.getfixturevalue(name)
    density = np.linspace(900.0, 1100.0, 10)
    people = random_people(body, 4, seed=1)
    solids_of_people = ip.mass_properties(people, body.template, density)
    volumes = ip.part_volumes(people, body.template)
    for index, vertices in enumerate(people):
        whole, parts = solids_of_people, solids_of_people.parts
        closed = oracles.closed_parts(vertices, body.faces, body.face_parts)
        for p, mesh in enumerate(closed):
            assert mesh.is_watertight
            one = ip.MassProperties(*(getattr(parts, key)[index, p] for key in ("volume", "mass", "center", "inertia")))
            agrees_with_trimesh(one, mesh, density[p])
            assert volumes[index, p] == pytest.approx(abs(mesh.volume), rel=ROUNDING)
        mass = sum(mesh.mass for mesh in closed)
        centre = sum(mesh.mass * mesh.center_mass for mesh in closed) / mass
        inertia = sum(mesh.moment_inertia + steiner(mesh.mass, mesh.center_mass - centre) for mesh in closed)
        assert whole.mass[index] == pytest.approx(mass, rel=ROUNDING)
        np.testing.assert_allclose(whole.center[index], centre, rtol=0, atol=ROUNDING)
        np.testing.assert_allclose(whole.inertia[index], inertia, rtol=0, atol=ROUNDING * mass)


def steiner(mass, arm):
    """What a mass has about a point at distance `arm` from its centre."""
    return mass * (arm @ arm * np.eye(3) - np.outer(arm, arm))


def test_box_in_closed_form():
    a, b, c = size = (0.6, 1.6, 0.4)
    vertices, faces = solids.box(size)
    solid = ip.mass_properties(vertices, ip.BodyTemplate(vertices, faces), density=1000.0)
    mass = 1000.0 * a * b * c
    assert solid.volume == pytest.approx(a * b * c, rel=1e-15)
    assert solid.mass == pytest.approx(mass, rel=1e-15)
    np.testing.assert_allclose(solid.center, [0.0, b / 2, 0.0], atol=1e-15)
    expected = mass / 12 * np.diag([b * b + c * c, a * a + c * c, a * a + b * b])
    np.testing.assert_allclose(solid.inertia, expected, atol=1e-13 * mass)


@pytest.mark.parametrize("shape", ["sphere", "capsule"])
def test_round_bodies_converge_to_their_closed_form(shape):
    radius, length = 0.5, 0.8
    if shape == "sphere":
        volume = 4 / 3 * np.pi * radius**3
        inertia = 0.4 * volume * radius**2 * np.eye(3)
        meshes = [trimesh.creation.icosphere(subdivisions=n, radius=radius) for n in (3, 4)]
    else:
        tube, ball = np.pi * radius**2 * length, 4 / 3 * np.pi * radius**3
        volume = tube + ball
        along = tube * radius**2 / 2 + ball * 0.4 * radius**2
        across = tube * (length**2 / 12 + radius**2 / 4) + ball * (
            0.4 * radius**2 + length**2 / 4 + 3 / 8 * length * radius
        )
        inertia = np.diag([across, across, along])
        meshes = [trimesh.creation.capsule(height=length, radius=radius, count=[n, n]) for n in (48, 96)]

    def values(mesh):
        solid = ip.mass_properties(mesh.vertices, ip.BodyTemplate(mesh.vertices, mesh.faces, num_samples=1), 1.0)
        return np.array([solid.volume, *np.ravel(solid.inertia)])

    coarse, fine = map(values, meshes)
    # An inscribed polyhedron errs by the square of its edge: halving the edges leaves a quarter, and the extrapolation
    # over the two is right to the fourth power.
    expected = np.array([volume, *inertia.ravel()])
    assert abs(fine[0] / volume - 1) < 0.01
    np.testing.assert_allclose((4 * fine - coarse) / 3, expected, rtol=1e-4, atol=1e-9)


@pytest.mark.parametrize("num_parts", [2, 3, 7, 40])
@pytest.mark.parametrize("seed", range(5))
def test_parts_add_up_for_any_segmentation(num_parts, seed, lite):
    """Salt and pepper: hundreds of three-part junctions, parts in many pieces, nearly all in one interface."""
    rng = np.random.default_rng(seed)
    labels = rng.integers(num_parts, size=len(lite.faces))
    labels[:num_parts] = np.arange(num_parts)
    vertices = ip.body.posed(lite, "warrior")
    template = ip.BodyTemplate(vertices, lite.faces, labels, num_samples=1)
    signed = ip.mass_properties(vertices, template).parts.volume
    whole = trimesh.Trimesh(vertices, lite.faces, process=False).volume
    # Parts of a shredded body are many times larger than the body and cancel: the rounding is theirs.
    assert signed.sum() == pytest.approx(whole, rel=0, abs=1e-12 * max(whole, np.abs(signed).sum()))
    np.testing.assert_allclose(ip.part_volumes(vertices, template), np.abs(signed), rtol=0, atol=1e-13)
    expected = [mesh.volume for mesh in oracles.closed_parts(vertices, lite.faces, labels)]
    np.testing.assert_allclose(signed, expected, rtol=0, atol=1e-12)


def test_a_three_part_junction_by_hand():
    """A cube in three pairs of sides, which all meet at two opposite corners: each part is two pyramids, a third."""
    vertices, faces = solids.box((1.0, 1.0, 1.0))
    corners = vertices[faces]
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    labels = np.abs(normal).argmax(axis=1)
    template = ip.BodyTemplate(vertices, faces, labels, num_samples=1)
    np.testing.assert_allclose(ip.part_volumes(vertices, template), 1 / 3, rtol=1e-14)
    np.testing.assert_allclose(ip.mass_properties(vertices, template).parts.center, [[0, 0.5, 0]] * 3, atol=1e-15)


def test_part_volumes_of_people_add_up(anny, random_people):
    people = random_people(anny, 4, seed=9)
    whole = [trimesh.Trimesh(vertices, anny.faces, process=False).volume for vertices in people]
    signed = ip.mass_properties(people, anny.template).parts.volume
    np.testing.assert_allclose(signed.sum(axis=-1), whole, rtol=1e-12)


@pytest.mark.parametrize("method", solids.METHODS)
@pytest.mark.parametrize("pose", ["standing", "tree", "push_up"])
def test_centres_of_mass(method, pose, lite):
    vertices = ip.body.posed(lite, pose) + [3.0, 1.0, -2.0]
    expected = oracles.center_of_mass(vertices, lite.template, method)
    np.testing.assert_allclose(ip.center_of_mass(vertices, lite.template, method), expected, rtol=0, atol=1e-12)


def test_pcom_is_the_default_and_is_not_the_exact_centre(anny):
    vertices = ip.body.posed(anny, "standing")
    pcom = ip.center_of_mass(vertices, anny.template)
    np.testing.assert_array_equal(pcom, ip.center_of_mass(vertices, anny.template, "pcom"))
    apart = np.linalg.norm(pcom - ip.center_of_mass(vertices, anny.template, "exact"))
    assert 0.03 < apart < 0.1  # samples sit on the skin, so the torso counts by area times volume


@pytest.mark.parametrize("far", [100.0, 1e4])
def test_far_from_the_origin(far, lite):
    vertices = ip.body.posed(lite, "standing") + far
    near = vertices - far  # exactly what is left of the shape after the rounding far away
    moved, stayed = (ip.mass_properties(v, lite.template) for v in (vertices, near))
    assert moved.volume == pytest.approx(stayed.volume, rel=1e-12)
    np.testing.assert_allclose(moved.center - far, stayed.center, rtol=0, atol=1e-15 * far + 1e-13)
    np.testing.assert_allclose(moved.inertia, stayed.inertia, rtol=0, atol=1e-11)


def test_single_precision_keeps_six_digits(anny):
    vertices = (ip.body.posed(anny, "standing") + 100.0).astype(np.float32)
    single = ip.mass_properties(vertices, anny.template)
    double = ip.mass_properties(vertices.astype(np.float64), anny.template)
    assert single.volume.dtype == np.float32
    assert single.volume == pytest.approx(double.volume, rel=1e-6)
    np.testing.assert_allclose(single.center, double.center, rtol=1e-7)  # half a unit in the last place at 100 m
    np.testing.assert_allclose(single.inertia, double.inertia, rtol=0, atol=1e-5 * np.abs(double.inertia).max())


def test_an_inverted_part_is_flagged_and_not_hidden(blob):
    """The body mirrored: every part is inside out, its volume negative by sign and positive by size."""
    mirrored = blob.vertices * [-1.0, 1.0, 1.0]
    assert ip.body_status(mirrored, blob, ip.Ground()) & ip.Status.INVERTED_PART
    assert not ip.body_status(blob.vertices, blob, ip.Ground()) & ip.Status.INVERTED_PART
    right, wrong = (ip.mass_properties(v, blob).parts.volume for v in (blob.vertices, mirrored))
    np.testing.assert_allclose(wrong, -right, rtol=1e-12)
    np.testing.assert_allclose(ip.part_volumes(mirrored, blob), ip.part_volumes(blob.vertices, blob), rtol=1e-12)


def test_an_open_box_is_closed_by_a_fan():
    """Without its lid the fan to the mean of the rim is the lid again."""
    vertices, faces = solids.box((0.6, 1.6, 0.4))
    lid = (vertices[faces][..., 1] > 1.5).all(axis=1)
    assert lid.sum() == 2
    template = ip.BodyTemplate(vertices, faces[~lid])
    assert not template.watertight
    assert ip.mass_properties(vertices, template).volume == pytest.approx(0.6 * 1.6 * 0.4, rel=1e-14)
    np.testing.assert_allclose(ip.part_volumes(vertices, template), [0.6 * 1.6 * 0.4], rtol=1e-14)
