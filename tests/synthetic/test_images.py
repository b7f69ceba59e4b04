"""Rendered images: what their labels claim, judged by plain loops, the engine, shapely and geometry."""

from __future__ import annotations

import itertools
import math

import numpy as np
import pytest
import trimesh

import ipman_rs as ip
from ipman_rs.body.landmarks import skin_points
from ipman_rs.synthetic.at_rest import FAMILIES
from ipman_rs.synthetic.images import cameras, clothing, environment, renderer, textures
from ipman_rs.synthetic.images.people import draw_person, keypoint_names
from ipman_rs.synthetic.images.renderer import Solid, shadow
from ipman_rs.synthetic.images.samples import RenderSettings, draw_sample, visible_points

SETTINGS = RenderSettings(seed=3, size=112, moving=0.5)


@pytest.fixture(scope="module")
def samples():
    """One of each family, and a second one."""
    return [draw_sample(SETTINGS, "train", number) for number in range(2 * len(FAMILIES))]


def posed(sample):
    labels = {name: sample.arrays[name].astype(float) for name in ("pose", "betas", "transl")}
    return ip.load_body("anny-lite")(**labels)


def projected(sample, point):
    """A pixel, written out: X_c = R X + t, x = K X_c / z."""
    rotation, translation, intrinsics = (
        sample.arrays[name].tolist() for name in ("camera_rotation", "camera_translation", "intrinsics")
    )
    camera = [sum(rotation[i][j] * point[j] for j in range(3)) + translation[i] for i in range(3)]
    image = [sum(intrinsics[i][j] * camera[j] for j in range(3)) for i in range(3)]
    return image[0] / image[2], image[1] / image[2]


@pytest.mark.slow
def test_keypoints_are_the_bodys_points_through_the_camera(samples):
    names, skin = keypoint_names("anny-lite"), skin_points(ip.load_body("anny-lite"))
    assert len(names) == len(set(names)) == 52
    for sample in samples:
        body = posed(sample)
        np.testing.assert_allclose(sample.arrays["joints"], body.joints, atol=1e-6)  # m, float32
        points = {**dict(zip(names[:24], body.joints, strict=True))}
        points |= {name: body.vertices[skin[name]] for name in names[24:]}
        for name, (x, y, inside) in zip(names, sample.arrays["keypoints"], strict=True):
            # Pixels; float32 has 1e-5 of 112
            assert math.dist((x, y), projected(sample, points[name].tolist())) < 1e-3
            assert inside == (0 <= x <= 112 and 0 <= y <= 112)


@pytest.mark.slow
def test_silhouette_is_that_of_the_mesh(samples):
    """Against the union of the projected triangles, by shapely: its area, and its bounds, which are the box."""
    from shapely import polygons, union_all

    faces = ip.load_body("anny-lite").faces
    for sample in samples[:7]:
        pixels = np.array([projected(sample, vertex) for vertex in posed(sample).vertices.tolist()])
        outline = union_all([polygon.buffer(0) for polygon in polygons(pixels[faces])])
        # Four points a pixel: what they miss of an outline of some hundred pixels is less than a pixel in a hundred.
        assert sample.covered.sum() == pytest.approx(outline.area, rel=0.01)
        low_x, low_y, high_x, high_y = outline.bounds
        np.testing.assert_allclose(sample.arrays["box"], [low_x, low_y, high_x - low_x, high_y - low_y], atol=1e-3)
        rows, columns = np.nonzero(sample.covered)
        np.testing.assert_allclose([columns.min(), rows.min()], [low_x, low_y], atol=1.5)
        np.testing.assert_allclose([columns.max() + 1, rows.max() + 1], [high_x, high_y], atol=1.5)


def test_everybody_is_in_the_image_and_every_camera_above_the_floor(samples):
    for sample in samples:
        x, y, width, height = sample.arrays["box"]
        assert min(x, y) > 0
        assert max(x + width, y + height) < 112
        assert max(width, height) > 0.55 * 112
        eye = -sample.arrays["camera_rotation"].T @ sample.arrays["camera_translation"]
        assert eye[1] > 0.1


def test_who_is_static_rests_on_the_floor(samples):
    """The engine's word: static people are balanced over what lies within 1 cm of the floor; jumping ones hover."""
    template, floor = ip.load_body("anny-lite").template, ip.Ground.y_up()
    kinds = {sample.record["kind"] for sample in samples}
    assert kinds == {"static", "tipped", "jumping"}
    for sample in samples:
        vertices, kind = posed(sample).vertices, sample.record["kind"]
        lowest = vertices[:, 1].min()
        assert sample.record["static"] == (kind == "static")
        if kind == "jumping":
            assert 0.15 - 1e-6 < lowest < 0.40 + 1e-6
        else:
            assert abs(lowest) < 1e-6
        if kind == "static":
            # The pose is rounded to float32 after settling, and turned: a hair's breadth at the polygon's edge.
            assert ip.support_margin(vertices, template, floor, 0.01, "exact") > -1e-4


def test_bodies_face_every_way_and_stand_about():
    draw = np.random.default_rng(0)
    figures = [draw_person(draw, "anny-lite", "standing", 0.0) for _ in range(40)]
    facing = ip.load_body("anny-lite")
    ahead = np.array([figure.posed()[1] for figure in figures])
    across = ahead[:, facing.joint_names.index("left_hip")] - ahead[:, facing.joint_names.index("right_hip")]
    headings = np.arctan2(across[:, 2], across[:, 0])
    assert np.histogram(headings, 4, (-np.pi, np.pi))[0].min() >= 3
    places = np.array([figure.transl for figure in figures])[:, [0, 2]]
    assert (np.abs(places) <= 1).all()
    assert places.std(axis=0).min() > 0.4
    betas = np.array([figure.betas for figure in figures])
    assert betas.std() == pytest.approx(1.0, abs=0.1)


def test_seeds_splits_and_numbers_draw_other_people():
    small = RenderSettings(seed=3, size=32)
    drawn = [
        draw_sample(small, "train", 0), draw_sample(small, "val", 0), draw_sample(small, "train", 7),
        draw_sample(RenderSettings(seed=4, size=32), "train", 0),
    ]  # fmt: skip
    assert {sample.record["family"] for sample in drawn} == {"standing"}
    for one, other in itertools.combinations(drawn, 2):
        assert np.abs(one.arrays["betas"] - other.arrays["betas"]).max() > 0.1
        assert (one.image != other.image).any()
    again = draw_sample(small, "val", 0)
    assert (again.image == drawn[1].image).all()


@pytest.fixture(scope="module")
def ball():
    """A ball of radius 0.2 m, 0.5 m above the floor."""
    mesh = trimesh.creation.icosphere(5, 0.2)
    return Solid(np.asarray(mesh.vertices) + [0.0, 0.5, 0.0], np.asarray(mesh.faces))


def plain(color):
    pattern = textures.draw_texture(np.random.default_rng(0), ("plain",), np.array(color, float), (1, 1), 0.0)
    return textures.Texture("plain", pattern.first, pattern.first, 1.0, 0.0, 0.0, pattern.lattice)


def test_ball_covers_what_perspective_says(ball):
    """A ball straight ahead at distance d is a disc of radius f r / √(d² − r²)."""
    rotation = cameras.view_rotation(0.0, 0.0, 0.0)
    camera = cameras.ImageCamera(
        200, rotation, -rotation @ [0.0, 0.5, 2.0], np.array([[300, 0, 100], [0, 300, 100], [0, 0, 1.0]])
    )
    draw = np.random.default_rng(0)
    clothes, around = clothing.draw_clothes(draw, "anny-lite"), environment.draw_environment(draw)
    picture = renderer.render(ball, ball.vertices, clothes, "anny-lite", around, camera)
    radius = 300 * 0.2 / math.sqrt(2**2 - 0.2**2)
    assert picture.covered.sum() == pytest.approx(math.pi * radius**2, rel=0.005)
    assert picture.covered[:, :100].sum() == pytest.approx(picture.covered[:, 100:].sum(), rel=1e-3)


def test_shadow_of_a_ball(ball):
    """Lit from 45°: the shadow's centre is as far away as the ball is high, its half axes are r and r √2."""
    towards = np.array([1.0, 1.0, 0.0]) / math.sqrt(2)
    grid = np.stack(np.meshgrid(np.linspace(-1.2, 0.6, 181), np.linspace(-0.6, 0.6, 121)), axis=-1).reshape(-1, 2)
    points = np.stack([grid[:, 0], np.zeros(len(grid)), grid[:, 1]], axis=1)
    dark = shadow(ball, points, np.tile(towards, (len(points), 1)))
    within = ((grid[:, 0] + 0.5) / (0.2 * math.sqrt(2))) ** 2 + (grid[:, 1] / 0.2) ** 2
    assert (dark[within < 0.94] == 1).all()
    assert (dark[within > 1.06] == 0).all()


@pytest.mark.filterwarnings("error")
def test_no_floor_is_seen(ball):
    """A camera that looks up sees what is behind the ball."""
    around = environment.draw_environment(np.random.default_rng(0))
    eye, rays = np.array([0.0, 0.3, 2.0], np.float32), np.array([[0, 0.3, -1], [0.2, 0.5, -1]], np.float32)
    np.testing.assert_array_equal(renderer.background(ball, eye, rays, 0 * rays, around), around.behind(eye, rays))


def test_light_follows_lambert():
    light = environment.Light(*(np.array(value, float) for value in ([0, 1, 0], [1] * 3, [0.5] * 3, [0.1] * 3)))
    up, side = np.array([[0.0, 1, 0]]), np.array([[1.0, 0, 0]])
    one, none = np.ones(1), np.zeros(1)
    np.testing.assert_allclose(light.on(up, one, one), 1.5)
    np.testing.assert_allclose(light.on(up, none, one), 0.5)
    np.testing.assert_allclose(light.on(up, none, none), 0.1)
    np.testing.assert_allclose(light.on(side, one, one), 0.3)


def test_visible_is_what_nothing_hides(ball):
    rotation = cameras.view_rotation(0.0, 0.0, 0.0)
    camera = cameras.ImageCamera(200, rotation, -rotation @ [0.0, 0.5, 2.0], np.eye(3))
    points = np.array([[0, 0.5, 0.1], [0, 0.5, 0.2], [0, 0.5, -0.2], [0.5, 0.5, -1.0]])
    assert visible_points(ball, camera, points, num_joints=1).tolist() == [True, True, False, True]
    assert visible_points(ball, camera, points, num_joints=3).tolist() == [True, True, False, True]


def test_looking_down_and_about():
    """At zero along −z with y up; turned by 90° along −x; looking down by 90° along −y."""
    ahead = np.array([0.0, 0.0, 1.0])
    for angles, expected in (((0, 0, 0), (0, 0, -1)), ((90, 0, 0), (-1, 0, 0)), ((0, 90, 0), (0, -1, 0))):
        np.testing.assert_allclose(cameras.view_rotation(*angles).T @ ahead, expected, atol=1e-12)
    np.testing.assert_allclose(cameras.view_rotation(0, 0, 0) @ [0, 1, 0], [0, -1, 0], atol=1e-12)


def test_patterns_repeat_by_the_cell():
    colors = plain((0.2, 0.4, 0.6))(np.array([[0.3, 0.4]]))
    np.testing.assert_allclose(colors, [[0.2, 0.4, 0.6]], rtol=1e-6)
    first, second = np.zeros(3), np.ones(3)
    checks = textures.Texture("checks", first, second, 0.5, 0.0, 0.0, np.zeros((64, 64)))
    plane = np.array([[0.1, 0.1], [0.3, 0.1], [0.3, 0.3], [0.6, 0.1], [0.1, 0.9]])
    assert checks(plane)[:, 0].tolist() == [0, 1, 0, 0, 1]


def test_clothes_are_where_they_belong():
    """Points of the mean body: hand and neck are skin, the breast is shirt, the thigh trousers, toes are shoes."""
    draw = np.random.default_rng(5)
    marks = clothing.landmarks("anny-lite")
    for _ in range(20):
        clothes = clothing.draw_clothes(draw, "anny-lite")
        points = np.array([marks["left_hand"], marks["right_hand"], marks["spine2"], marks["left_big_toe"]])
        hand, other, breast, toe = clothes(points, "anny-lite")
        assert (hand == clothes.skin).all()
        assert (other == clothes.skin).all()
        span = clothes.shirt.first, clothes.shirt.second
        assert (breast >= np.minimum(*span) * 0.7).all()
        assert (breast <= np.maximum(*span) * 1.3).all()
        assert (toe == (clothes.skin if clothes.shoes is None else clothes.shoes)).all()
