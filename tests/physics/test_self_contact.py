"""Self-penetration and the cost of self-contact: libigl's winding numbers, balls, arms in a trunk."""

from __future__ import annotations

import igl
import numpy as np
import pytest
import trimesh

import ipman_rs as ip
from ipman_rs.self_contact import collision
from tests.helpers import overlapping


@pytest.fixture(scope="module")
def arms(lite):
    vertices = overlapping.arms_in_trunk(lite)
    vertices.setflags(write=False)
    return vertices


@pytest.mark.parametrize("pose", ["tree", "squat", "cobra"])
def test_winding_numbers_of_poses_are_libigls(lite, pose):
    vertices = ip.body.posed(lite, pose)
    expected = igl.winding_number(vertices, lite.template.faces, vertices)
    found = collision(lite.template, 0.3).windings(vertices[None])[0]
    np.testing.assert_allclose(found, expected, rtol=0, atol=1e-12)  # sums of 2,454 angles in double precision


def test_winding_numbers_of_arms_in_a_trunk_are_libigls(lite, arms):
    tables = collision(lite.template, 0.3)
    expected = np.stack([igl.winding_number(body, lite.template.faces, body) for body in arms])
    assert ((expected > 0.99).sum(axis=1) > [10, 20, 40]).all()
    np.testing.assert_allclose(tables.windings(arms), expected, rtol=0, atol=1e-12)
    # In single precision coordinates are right to 1e-7 m, and thin fingers see angles of them.
    np.testing.assert_allclose(tables.windings(arms.astype(np.float32)), expected, rtol=0, atol=2e-4)


@pytest.mark.slow
def test_large_and_open_meshes(anny):
    """The tree's short cuts over many levels, and over a boundary: the mesh without one of its legs."""
    vertices = overlapping.arms_in_trunk(anny, 1)[0]
    some = np.random.default_rng(0).choice(len(vertices), 200, replace=False)
    expected = igl.winding_number(vertices, anny.template.faces, vertices[some])
    np.testing.assert_allclose(collision(anny.template, 0.02).windings(vertices[None])[0][some], expected, atol=1e-11)

    whole = trimesh.creation.icosphere(subdivisions=3, radius=0.8)
    points, faces = np.array(whole.vertices), np.array(whole.faces)
    faces = faces[points[faces, 1].max(axis=1) < 0.5]
    template = ip.BodyTemplate(points, faces, num_samples=10)
    used = np.unique(faces)
    expected = igl.winding_number(points, faces, points)[used]
    assert expected.max() < 0.95
    np.testing.assert_allclose(collision(template, 0.1).windings(points[None])[0][used], expected, atol=1e-12)


def test_balls_pushed_into_each_other():
    """Depths lie between those of the balls around and inside the polyhedra."""
    template, count = overlapping.balls(subdivisions=3)
    vertices = overlapping.pushed_together(template, count)
    found = ip.self_penetration(vertices, template)
    faces, radius = template.faces, overlapping.RADIUS
    inner = np.linalg.norm(template.vertices[faces[: len(faces) // 2]].mean(axis=1), axis=1).min()
    assert inner > radius - 0.003
    for own, center in ((slice(None, count), [0.6, 0.03, 0.01]), (slice(count, None), [0.0, 0.0, 0.0])):
        distance = np.linalg.norm(vertices[own] - center, axis=1)
        inside, depth = found.inside[own], found.depth[own]
        assert inside[distance < inner].all()
        assert not inside[distance > radius].any()
        assert (depth[inside] <= radius - distance[inside] + 1e-12).all()
        assert (depth[inside] >= inner - distance[inside] - 1e-12).all()
    assert found.num_inside == found.inside.sum() > 30
    assert found.deepest == found.depth.max() > 0.15


def test_the_cost_is_the_papers_sum_over_those_depths():
    template, count = overlapping.balls(subdivisions=3)
    vertices = overlapping.pushed_together(template, count)
    depth = ip.self_penetration(vertices, template).depth
    push, nothing = ip.self_contact_loss(vertices, template, near=0.0)
    assert push == pytest.approx(0.5 * (np.tanh(depth / 0.04) ** 2).sum(), rel=1e-12)
    assert nothing == 0.0

    # Apart by 1 cm: nothing to push, the tips are pulled. The distance to the other ball by libigl.
    apart = overlapping.pushed_together(template, count, (-1.19, 0.0, 0.0))
    faces = template.faces[: len(template.faces) // 2]
    total = 0.0
    for own, other in ((apart[:count], apart[count:]), (apart[count:], apart[:count])):
        away = np.sqrt(igl.point_mesh_squared_distance(own, other, faces)[0])
        total += 0.5 * 0.005 * (np.tanh(away[away < 0.02] / 0.005) ** 2).sum()
    push, pull = ip.self_contact_loss(apart, template)
    assert push == 0.0
    assert pull == pytest.approx(total, rel=1e-9)
    assert pull > 0.004


def test_skin_is_no_obstacle_to_itself(lite):
    """Joints that bend crease their own skin; nothing of that is another part."""
    creased = 0
    for name in ("standing", "t_pose", "lunge", "sitting", "kneeling", "all_fours"):
        vertices = ip.body.posed(lite, name)
        creased += (collision(lite.template, 0.3).windings(vertices[None]) > 0.99).sum()
        assert ip.self_penetration(vertices, lite.template).num_inside == 0
    assert creased > 20
    assert ip.self_penetration(ip.body.posed(lite, "sitting"), lite.template, geodesic=0.05).num_inside > 0


def test_depth_grows_with_the_pose(lite, arms):
    found = ip.self_penetration(arms, lite.template)
    assert (np.diff(found.deepest) > 0.01).all()
    assert found.depth.shape == found.inside.shape == arms.shape[:2]
    assert (found.inside == (found.depth > 0)).all()


@pytest.mark.parametrize("dtype", [np.float32, np.float64])
def test_same_bits_at_any_place_and_for_any_number_of_threads(lite, arms, dtype):
    vertices = arms.astype(dtype)
    alone = [ip.self_contact_loss(body, lite.template) for body in vertices]
    depths = [ip.self_penetration(body, lite.template).depth for body in vertices]
    order = [2, 0, 1, 1, 2, 0, 0]
    threads = ip.get_num_threads()
    try:
        for number in (1, 2, 5):
            ip.set_num_threads(number)
            push, pull = ip.self_contact_loss(vertices[order], lite.template)
            depth = ip.self_penetration(vertices[order], lite.template).depth
            for place, body in enumerate(order):
                assert (push[place], pull[place]) == alone[body]
                assert (depth[place] == depths[body]).all()
    finally:
        ip.set_num_threads(threads)


def test_single_precision_decides_as_double(lite, arms):
    single = ip.self_penetration(arms.astype(np.float32), lite.template)
    double = ip.self_penetration(arms.astype(np.float32).astype(np.float64), lite.template)
    assert (single.inside == double.inside).all()
    np.testing.assert_allclose(single.depth, double.depth, rtol=1e-7)  # the result's rounding alone


def test_far_from_the_worlds_origin(lite, arms):
    """Shifted by a power of two: the coordinates' rounding is the same, so is everything."""
    vertices = (np.round(arms * 2**20) / 2**20)[:1]
    near, far = (ip.self_penetration(vertices + shift, lite.template) for shift in (0.0, 64.0))
    np.testing.assert_allclose(far.depth, near.depth, rtol=0, atol=1e-12)


def test_a_bad_body_leaves_the_others_alone(lite, arms):
    vertices = arms.copy()
    vertices[1, 5, 0] = np.nan
    push, pull = ip.self_contact_loss(vertices, lite.template)
    good_push, good_pull = ip.self_contact_loss(arms, lite.template)
    assert np.isnan([push[1], pull[1]]).all()
    assert (push[[0, 2]] == good_push[[0, 2]]).all()
    assert (pull[[0, 2]] == good_pull[[0, 2]]).all()
    found = ip.self_penetration(vertices, lite.template)
    assert np.isnan(found.depth[1]).all()
    assert np.isnan(found.deepest[1])
    assert found.num_inside[1] == 0
    assert found.num_inside[2] > 10


def test_batch_dimensions_are_free(lite, arms):
    assert ip.self_penetration(arms[0], lite.template).depth.shape == arms[0, :, 0].shape
    assert isinstance(ip.self_contact_loss(arms[0], lite.template)[0], float)
    assert ip.self_contact_loss(arms[:, None], lite.template)[1].shape == (3, 1)
    assert ip.self_penetration(arms[:0], lite.template).deepest.shape == (0,)


@pytest.mark.parametrize("scale", [0.0, 1e-20, 1e15])
def test_bodies_of_no_size_and_of_any(lite, arms, scale):
    push, pull = ip.self_contact_loss(arms * scale, lite.template)
    assert np.isfinite(push).all()
    assert np.isfinite(pull).all()


def test_wrong_arguments(lite, arms):
    with pytest.raises(ValueError, match=r"vertices: expected \(\.\.\., 1229, 3\)"):
        ip.self_penetration(arms[:, :5], lite.template)
    with pytest.raises(ValueError, match="geodesic: expected zero or more, got -1"):
        ip.self_penetration(arms, lite.template, geodesic=-1)
    with pytest.raises(ValueError, match="push_width: expected positive metres, got 0"):
        ip.self_contact_loss(arms, lite.template, push_width=0)
    with pytest.raises(ValueError, match="pull_weight: expected zero or more"):
        ip.self_contact_loss(arms, lite.template, pull_weight=-0.1)
