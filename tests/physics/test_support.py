"""The base of support against scipy's qhull, shapely and scipy's linear programming."""

from __future__ import annotations

import numpy as np
import pytest
import scipy.optimize
import shapely
from scipy.spatial import ConvexHull

import ipman_rs as ip
from tests.helpers import oracles, solids

FLOOR = np.array([0.0, 1.0, 0.0])


def contacts(vertices, template, normal, height, threshold, rule="paper"):
    """The contact samples on the ground, in the plane's own two coordinates (n, 2)."""
    points = oracles.samples(np.asarray(vertices, float), template)
    h = oracles.heights(points, normal, height)
    touching = np.abs(h) < threshold if rule == "paper" else h < threshold
    if rule == "released" and touching.sum() <= 10:
        touching[:] = False
    return points[touching] @ oracles.frame(normal).T


def judged_margin(vertices, template, normal, height, threshold, method="pcom", rule="paper"):
    centre = oracles.center_of_mass(vertices, template, method) @ oracles.frame(normal).T
    return oracles.signed_margin(contacts(vertices, template, normal, height, threshold, rule), centre)


@pytest.mark.slow
@pytest.mark.parametrize("name", ip.body.poses.NAMES)
def test_named_poses_against_qhull_and_shapely(name, anny):
    vertices = ip.body.posed(anny, name)
    found = ip.base_of_support(vertices, anny.template, ip.Ground())
    flat = contacts(vertices, anny.template, FLOOR, 0.0, 0.1)
    hull = ConvexHull(flat)
    assert found.num_contacts == len(flat)
    assert found.has_contact
    # Both find extreme points of the same set; areas of a square metre agree to rounding.
    assert found.area == pytest.approx(hull.volume, rel=1e-12)
    corners = found.polygon @ oracles.frame(FLOOR).T
    ours, theirs = shapely.Polygon(corners), shapely.MultiPoint(flat).convex_hull
    assert ours.is_valid
    assert ours.symmetric_difference(theirs).area < 1e-12
    assert ours.exterior.is_ccw
    np.testing.assert_allclose(found.polygon[:, 1], 0.0, atol=1e-15)

    centre = shapely.Point(oracles.center_of_mass(vertices, anny.template, "pcom") @ oracles.frame(FLOOR).T)
    margin = theirs.exterior.distance(centre) * (1 if theirs.contains(centre) else -1)
    assert found.margin == pytest.approx(margin, abs=1e-12)
    assert found.inside == (margin > 0)
    assert ip.support_margin(vertices, anny.template, ip.Ground()) == pytest.approx(margin, abs=1e-12)
    assert ip.bose(vertices, anny.template, ip.Ground()) == (margin > 0)
    assert ip.bose(vertices, anny.template, ip.Ground(), method="lp") == (margin > 0)


@pytest.mark.parametrize("method", solids.METHODS)
@pytest.mark.parametrize("rule", ["paper", "released"])
def test_margins_on_sloping_ground(method, rule, blob):
    bodies = solids.posed(blob, 30, seed=8)
    normal, height = np.array([0.2, 1.0, -0.1]) / np.linalg.norm([0.2, 1.0, -0.1]), 0.02
    ground = ip.Ground(normal, height)
    got = ip.support_margin(bodies, blob, ground, 0.15, method, rule)
    expected = [judged_margin(vertices, blob, normal, height, 0.15, method, rule) for vertices in bodies]
    np.testing.assert_allclose(got, expected, rtol=0, atol=1e-12)
    found = ip.base_of_support(bodies, blob, ground, 0.15, method, rule)
    np.testing.assert_allclose(found.margin, expected, rtol=0, atol=1e-12)
    assert (np.array(expected) > 0).any()
    assert (np.array(expected) < 0).any()
    for polygon, area in zip(found.polygon, found.area, strict=True):
        # Counter-clockwise about the normal: the area vector points along it.
        assert polygon.shape[1] == 3
        np.testing.assert_allclose(oracles.heights(polygon, normal, height), 0.0, atol=1e-14)
        area_vector = np.cross(polygon[1:-1] - polygon[0], polygon[2:] - polygon[0]).sum(axis=0) / 2
        assert area_vector @ normal == pytest.approx(area, abs=1e-15)


@pytest.mark.slow
def test_programme_and_hull_agree_on_a_thousand_people(lite):
    """Random poses, leans and slopes of the embedded body with a few hundred contacts at most, and the paper's own
    programme, whether the centre is a convex combination of the contacts, by scipy on some of them."""
    rng = np.random.default_rng(12)
    pose = rng.normal(scale=0.2, size=(1000, 24, 3))
    pose[:, 0] = rng.normal(scale=0.15, size=(1000, 3))
    people = lite(pose, rng.normal(size=(1000, 10))).vertices
    people[..., 1] -= people[..., 1].min(axis=-1, keepdims=True)
    template = lite.make_template(num_samples=4000)
    normals = rng.normal(scale=0.08, size=(1000, 3)) + FLOOR
    lowest = np.einsum("bvk,bk->bv", people, normals / np.linalg.norm(normals, axis=-1, keepdims=True)).min(axis=1)
    ground = ip.Ground(normals, lowest + rng.uniform(-0.02, 0.05, 1000))

    found = ip.base_of_support(people, template, ground)
    assert 100 < np.median(found.num_contacts) < 500
    decided = np.abs(found.margin) > 1e-9
    assert decided.sum() > 990
    assert 0.1 < found.inside.mean() < 0.9
    assert (found.margin[~found.inside] > -0.02).sum() > 50  # near misses are where the two could differ
    hull = ip.bose(people, template, ground)
    np.testing.assert_array_equal(hull, found.inside)
    programme = ip.bose(people, template, ground, method="lp")
    np.testing.assert_array_equal(programme[decided], hull[decided])

    for index in rng.choice(np.flatnonzero(np.abs(found.margin) > 1e-4), 60, replace=False):
        normal, height = ground.normal[index], ground.height[index]
        flat = contacts(people[index], template, normal, height, 0.1)
        if len(flat) == 0:
            assert not programme[index]
            continue
        centre = oracles.center_of_mass(people[index], template, "pcom") @ oracles.frame(normal).T
        judge = scipy.optimize.linprog(
            np.zeros(len(flat)), A_eq=np.vstack([flat.T, np.ones(len(flat))]), b_eq=[*centre, 1.0], bounds=(0, None)
        )
        assert programme[index] == (judge.status == 0)


@pytest.mark.parametrize("method", ["hull", "lp"])
def test_the_three_named_falls(method, lite):
    for name, balanced in (("standing", True), ("lying", True), ("lean_past_toes", False)):
        vertices = ip.body.posed(lite, name)
        assert ip.bose(vertices, lite.template, ip.Ground(), method=method) == balanced, name


def lowest_samples(template, count):
    """A threshold that exactly `count` samples of the template's own shape pass, above a ground below all of them."""
    h = np.sort(oracles.samples(template.vertices, template)[:, 1] + 0.001)
    return ip.Ground.y_up(-0.001), (h[count - 1] + h[count]) / 2


@pytest.mark.parametrize("count", [1, 2, 3])
@pytest.mark.parametrize("method", ["vertex_mean", "pcom"])
def test_few_contacts(count, method, blob):
    ground, threshold = lowest_samples(blob, count)
    found = ip.base_of_support(blob.vertices, blob, ground, threshold, method)
    expected = judged_margin(blob.vertices, blob, FLOOR, -0.001, threshold, method)
    assert found.num_contacts == count
    assert found.has_contact
    assert found.polygon.shape == (count, 3)
    assert found.margin == pytest.approx(expected, abs=1e-13)
    assert ip.support_margin(blob.vertices, blob, ground, threshold, method) == pytest.approx(expected, abs=1e-13)
    if count < 3:
        assert found.area == 0.0
        assert expected < 0
        assert not found.inside
        assert not ip.bose(blob.vertices, blob, ground, threshold, com_method=method)
    assert ip.bose(blob.vertices, blob, ground, threshold, "lp", method) == found.inside


@pytest.mark.parametrize("slope", [0.0, 2.0, 0.3])
def test_collinear_contacts(slope, blob):
    """A body squashed into a vertical plane stands on a line: no area, and no inside but on the line itself."""
    flat = blob.vertices.copy()
    flat[:, 2] = slope * flat[:, 0]
    found = ip.base_of_support(flat, blob, ip.Ground(), method="vertex_mean")
    assert found.num_contacts > 5
    assert found.area == pytest.approx(0.0, abs=1e-15)
    assert found.margin == pytest.approx(0.0, abs=1e-12)  # the centre lies in the plane too
    aside = flat.copy()
    aside[np.setdiff1d(np.arange(blob.num_vertices), touching_vertices(flat, blob))] += [0.0, 0.0, 0.5]
    found = ip.base_of_support(aside, blob, ip.Ground(), 0.02, method="vertex_mean")
    expected = judged_margin(aside, blob, FLOOR, 0.0, 0.02, "vertex_mean")
    assert found.margin < -0.1
    assert found.margin == pytest.approx(expected, abs=1e-9)
    assert not found.inside
    assert not ip.bose(aside, blob, ip.Ground(), 0.02, "lp", "vertex_mean")


def touching_vertices(vertices, template):
    """The vertices of every face that reaches below 2 cm, so that moving the others leaves the contacts alone."""
    low = (vertices[template.faces][..., 1] < 0.02).any(axis=1)
    return np.unique(template.faces[low])


@pytest.mark.parametrize("shift", [0.0, 10.0])
def test_duplicate_contacts(shift, blob):
    """The whole body in one point: every sample is the same contact."""
    point = np.zeros_like(blob.vertices) + [shift, 0.0, 0.25]
    found = ip.base_of_support(point, blob, ip.Ground(), method="sample_mean")
    assert found.num_contacts == 300
    assert found.area == 0.0
    assert found.margin == pytest.approx(0.0, abs=1e-12)


def test_airborne(blob):
    flying = blob.vertices + [0.0, 0.5, 0.0]
    found = ip.base_of_support(flying, blob, ip.Ground())
    assert found.polygon.shape == (0, 3)
    assert found.area == 0.0
    assert found.margin == -np.inf
    assert not found.inside
    assert not found.has_contact
    assert found.num_contacts == 0
    assert ip.support_margin(flying, blob, ip.Ground()) == -np.inf
    assert not ip.bose(flying, blob, ip.Ground())
    assert not ip.bose(flying, blob, ip.Ground(), method="lp")
    assert ip.body_status(flying, blob, ip.Ground()) == ip.Status.NO_CONTACT
    for loss in (ip.stability_loss, ip.balance_cost):
        assert np.isfinite(loss(flying, blob, ip.Ground()))
    assert np.isfinite(ip.center_of_pressure(flying, blob, ip.Ground())).all()


def test_contact_is_strictly_below_the_threshold():
    """A plate whose underside lies exactly at τ does not touch; a hair lower it does."""
    template = solids.plate()
    at = template.vertices + [0.0, 0.125, 0.0]
    assert not ip.base_of_support(at, template, ip.Ground(), 0.125).has_contact
    assert ip.base_of_support(at, template, ip.Ground(), np.nextafter(0.125, 1)).has_contact


def test_the_two_rules_of_contact():
    """Sunk by 1 m: the paper's |h| < τ sees no contact, the released code's h < τ sees all samples. And the released
    code takes ten contacts for none."""
    template = solids.plate(num_samples=64)
    sunk = template.vertices - [0.0, 1.0, 0.0]
    assert not ip.base_of_support(sunk, template, ip.Ground()).has_contact
    assert ip.base_of_support(sunk, template, ip.Ground(), contact="released").num_contacts == 64
    assert not ip.bose(sunk, template, ip.Ground())
    assert ip.bose(sunk, template, ip.Ground(), contact="released")

    body = solids.blob()
    for count, seen in ((10, 0), (11, 11)):
        ground, threshold = lowest_samples(body, count)
        found = ip.base_of_support(body.vertices, body, ground, threshold, contact="released")
        assert found.num_contacts == seen
        assert found.has_contact == (seen > 0)
        margin = ip.support_margin(body.vertices, body, ground, threshold, contact="released")
        assert margin == found.margin
        assert np.isfinite(margin) == (seen > 0)


def test_a_square_foot_by_ruler():
    """A box seen from above: the polygon is all but the box's base, the margin the distance to its nearest side."""
    vertices, faces = solids.box((0.4, 1.0, 0.2))
    template = ip.BodyTemplate(vertices, faces, num_samples=200_000)
    found = ip.base_of_support(vertices, template, ip.Ground(), 0.5, method="exact")
    # 40,000 samples on each side leave gaps of about 1/200 of it at its edges.
    assert found.area == pytest.approx(0.08, rel=5e-3)
    assert found.margin == pytest.approx(0.1, abs=1e-3)
    tipped = vertices + vertices[:, 1:2] * [0.5, 0.0, 0.0]  # the exact centre moves by 0.25 m
    found = ip.base_of_support(tipped, template, ip.Ground(), 0.01, method="exact")
    assert found.margin == pytest.approx(-0.05, abs=6e-3)


def test_nested_polygons(blob, bodies):
    batch = np.stack([bodies, bodies + [1.0, 0.0, 0.0]])
    found = ip.base_of_support(batch, blob, ip.Ground())
    assert [len(row) for row in found.polygon] == [6, 6]
    for row, shift in zip(found.polygon, (0.0, 1.0), strict=True):
        for polygon, vertices in zip(row, bodies, strict=True):
            alone = ip.base_of_support(vertices + [shift, 0.0, 0.0], blob, ip.Ground())
            np.testing.assert_array_equal(polygon, alone.polygon)
