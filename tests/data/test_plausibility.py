"""The checks of all input, on the named poses turned every way: what is refused, what is odd, what passes."""

from __future__ import annotations

import re

import numpy as np
import pytest

import ipman_rs as ip
from ipman_rs.data import plausibility
from ipman_rs.data.check import Finding, near_origin
from ipman_rs.data.plausibility import NoPerson, admit

UPRIGHT = tuple(name for name in ip.body.poses.NAMES if name != "lying")
ON_FEET = ("standing", "t_pose", "a_pose", "walking", "one_leg", "warrior", "lunge", "chair", "squat", "kneeling")
TURNS = {  # what became of the axes: (x, −z, y), cyclic both ways, on the side
    "z": ([0, 2, 1], [1, -1, 1]), "-z": ([0, 2, 1], [1, 1, -1]), "cyclic z": ([2, 0, 1], [1, 1, 1]),
    "cyclic x": ([1, 2, 0], [1, 1, 1]), "x": ([1, 0, 2], [1, 1, -1]),
}  # fmt: skip


def levels(name, up=(0, 1, 0), scale=1.0, parts=True, **said):
    body = ip.load_body("anny-lite")
    vertices = ip.body.posed(body, name) * scale
    template = body.template if parts else ip.BodyTemplate(ip.body.posed(body, name), body.faces)
    findings = plausibility.bodies(vertices[None], template, np.array(up, float), **said)
    return [each for each in findings if each.level != "ok"]


@pytest.mark.parametrize("name", UPRIGHT)
def test_people_on_their_ground_pass(name):
    assert levels(name) == []


@pytest.mark.parametrize("turn", TURNS)
@pytest.mark.parametrize("name", [*ON_FEET, "sitting"])
@pytest.mark.parametrize("body", ["anny-lite", "anny"])
def test_no_turned_body_passes(body, name, turn):
    order, signs = TURNS[turn]
    body = ip.load_body(body)
    vertices = ip.body.posed(body, name)[:, order] * signs
    found = plausibility.bodies(vertices[None], body.template, np.array([0.0, 1.0, 0.0]))
    odd = [each for each in found if each.level != "ok"]
    assert odd
    assert odd[0].option.removeprefix("`up='").removesuffix("'`").lstrip("-") == turn[-1]


def test_who_lies_is_odd_unless_up_is_said():
    (found,) = levels("lying")
    assert (found.level, found.option) == ("odd", "`up='-z'`")
    assert levels("lying", up_is_said=True) == []


@pytest.mark.parametrize("name", ON_FEET)
def test_who_stands_on_the_head_is_refused(name):
    (found,) = levels(name, up=(0, -1, 0))
    assert (found.level, found.option) == ("wrong", "`up='y'`")
    with pytest.raises(NoPerson, match=r"^a\.obj: stands on its head.*`up='y'` if so.*`force`"):
        admit("a.obj", [found])
    assert admit("a.obj", [found], force=True) == ("stands on its head, with its feet in the air; `up='y'` if so",)
    assert levels(name, up=(0, -1, 0), up_is_said=True) == []


@pytest.mark.parametrize("name", ["standing", "walking", "lunge", "one_leg"])
def test_another_axis_is_odd_in_one_body_and_wrong_in_many(name):
    body = ip.load_body("anny-lite")
    vertices = np.repeat(ip.body.posed(body, name)[None], 3, axis=0)
    for up in ((0, 0, 1), (1, 0, 0)):
        (found,) = levels(name, up=up)
        assert (found.level, found.option) == ("odd", "`up='y'`")
        *fine, found = plausibility.bodies(vertices, body.template, np.array(up, float))
        assert {each.level for each in fine} == {"ok"}
        assert (found.level, found.option) == ("wrong", "`up='y'`")


@pytest.mark.parametrize("name", ["standing", "t_pose", "a_pose", "walking", "lunge"])
def test_a_mesh_without_known_parts_is_judged_by_its_shape(name):
    (found,) = levels(name, up=(0, -1, 0), parts=False)
    assert (found.level, found.option) == ("odd", "`up='y'`")


@pytest.mark.parametrize(
    ("scale", "option"),
    [
        (1e3, "`units='mm'`"),
        (1e2, "`units='cm'`"),
        (10, "`units='dm'`"),
        (1 / 0.0254, "`units='in'`"),
        (60, "`units='in'` or `units='cm'`"),
        (1 / 0.3048, "`units='ft'`"),
        (1e-3, "`units='km'`"),
        (1e-5, "`units=UNIT`"),
    ],
)
def test_other_units_are_refused(scale, option):
    (found,) = levels("standing", scale=scale)
    assert (found.level, found.option) == ("wrong", option)


@pytest.mark.parametrize(
    ("kilograms", "level"), [(70, None), (2.1, None), (1.5, "odd"), (300, "odd"), (0.6, "wrong"), (5.9e10, "wrong")]
)
def test_mass(kilograms, level):
    assert [each.level for each in plausibility.mass(kilograms)] == ([level] if level else [])


@pytest.mark.parametrize(
    ("kilograms", "span", "level"),
    [(65, 1.8, None), (65, 2.4, None), (65, 0.95, None), (13, 0.95, None), (2.1, 0.55, None), (200, 1.8, None),
     (11, 1.8, "odd"), (3.8, 1.8, "wrong"), (4.6, 1.8, "wrong"), (4.4, 0.2, "wrong"), (200, 0.9, "odd")],
)  # fmt: skip
def test_mass_against_size(kilograms, span, level):
    assert [each.level for each in plausibility.mass(kilograms, span)] == ([level] if level else [])


@pytest.mark.parametrize(
    ("hertz", "level"), [(30, None), (1, "odd"), (1e5, "odd"), (0, "wrong"), (np.nan, "wrong"), (-30, "wrong")]
)
def test_rate(hertz, level):
    assert [each.level for each in plausibility.rate(hertz)] == ([level] if level else [])


@pytest.mark.parametrize(("metres", "level"), [(0.01, None), (0.05, "odd"), (416, "wrong")])
def test_marker_error(metres, level):
    assert [each.level for each in plausibility.marker_error(metres)] == ([level] if level else [])


@pytest.mark.parametrize(
    ("known", "unknown", "level"), [(55, 0, None), (40, 15, "odd"), (6, 49, "wrong"), (3, 2, "wrong")]
)
def test_known_markers(known, unknown, level):
    found = plausibility.known_markers(*([f"m{index}" for index in range(count)] for count in (known, unknown)))
    assert [each.level for each in found] == ([level] if level else [])
    assert level is None or f"{unknown} of {known + unknown} markers" in found[0].what


def test_admit_passes_what_is_merely_missing():
    assert admit("a", [Finding("ok", "x"), Finding("missing", "y"), Finding("odd", "z", "look")]) == ("z; look",)


IMAGE = np.array([640.0, 480.0])
PERSON = np.array(
    [[320, 90], [350, 140], [290, 140], [366, 255], [274, 255], [338, 260], [302, 260], [342, 420], [298, 420]], float
)


def of_keypoints(points, size=IMAGE, confidence=0.9):
    given = np.broadcast_to(confidence, len(points))
    return plausibility.keypoints(np.column_stack([points, given]), np.array(size, float))


@pytest.mark.parametrize(
    ("points", "level", "says"),
    [
        (PERSON, "ok", "a person of 330 pixels in an image of 640 × 480 pixels"),
        (PERSON[::-1] * [1, -1] + [0, 480], "ok", "a person"),  # upside down is for the fit to tell
        (PERSON / IMAGE, "wrong", "points of 0.188 to 0.875 look relative to the image"),
        (2 * PERSON / IMAGE - 1, "wrong", "look relative to the image"),
        (np.tile([100.0, 100.0], (9, 1)), "wrong", r"all 9 points lie at one place, \(100, 100\)"),
        (np.repeat(PERSON[:, :1], 2, axis=1), "wrong", "all 9 points lie on one line"),
        (PERSON * [1, 0.001], "wrong", "all 9 points lie on one line"),
        (PERSON * 3, "wrong", "9 of 9 points lie outside the image of 640 × 480 pixels: x from 822 to 1098"),
        (PERSON + [0, 200], "ok", "a person"),  # the feet alone are outside
        (PERSON / 20 + 100, "odd", "the person is 16 pixels large"),
        (PERSON[:3], None, ""),
    ],
)
def test_keypoints(points, level, says):
    found = of_keypoints(points)
    assert [each.level for each in found] == ([] if level is None else [level])
    assert level is None or re.search(says, found[0].what)


def test_keypoints_that_the_detector_is_not_sure_of_may_lie_outside():
    points = np.where(np.arange(9)[:, None] < 5, PERSON, PERSON + [0, 1000])
    assert of_keypoints(points, confidence=np.where(np.arange(9) < 5, 0.9, 0.3))[0].level == "ok"
    assert of_keypoints(points[::-1])[0].level == "ok"  # four of nine
    assert of_keypoints(PERSON + [0, 1000], confidence=0.3)[0].level == "wrong"  # sure of none: all are judged


def test_keypoints_of_another_image_size_name_the_option():
    with pytest.raises(NoPerson, match=r"a.json: 9 of 9 .*is that its size\? \(`image_size=WxH`\) \(`force`"):
        admit("a.json", of_keypoints(PERSON * 3))
    (said,) = admit("a.json", of_keypoints(PERSON * 3), force=True)
    assert "lie outside the image" in said


def test_a_body_in_another_world_is_refused_and_one_high_up_is_odd():
    body = ip.load_body("anny-lite")
    standing = ip.body.posed(body, "standing")[None]
    up = np.array([0.0, 1.0, 0.0])
    for away, level in (((900, 0, 0), "wrong"), ((0, 60, 0), "odd"), ((0, -60, 0), "odd"), ((60, 3, 0), "ok")):
        found = plausibility.bodies(standing + away, body.template, up, up_is_said=True)
        assert found[-1].level == level


def test_one_body_of_another_size_among_many_is_odd():
    body = ip.load_body("anny-lite")
    bodies = np.repeat(ip.body.posed(body, "standing")[None], 9, axis=0)
    bodies[4] *= 0.01
    findings = plausibility.bodies(bodies, body.template, np.array([0.0, 1.0, 0.0]))
    found = [each for each in findings if each.level != "ok"]
    assert [each.level for each in found] == ["odd"]
    assert "1 of 9 bodies" in found[0].what


@pytest.mark.parametrize(("unit", "option"), [(1, None), (100, "`units='cm'`"), (1000, "`units='mm'`")])
def test_places_of_people_about_the_origin(unit, option):
    draw = np.random.default_rng(0)
    places = unit * np.column_stack([draw.normal(0, 1, 200), np.full(200, 0.9), 2 + draw.normal(0, 1, 200)])
    assert [each.option for each in near_origin("trans", places)] == ([] if option is None else [option])


@pytest.mark.parametrize(("metres", "levels"), [(0.02, []), (2.0, ["odd"])])
def test_speed(metres, levels):
    places = np.outer(np.arange(50), [metres, 0, 0])
    assert [each.level for each in plausibility.speed("trans", places, np.arange(50) / 60)] == levels
    assert plausibility.speed("trans", places, None) == []


def test_speed_of_places_that_are_not_finite(recwarn):
    places = np.outer(np.arange(50), [2.0, 0, 0])
    places[[3, 4, 20]] = np.inf, np.inf, np.nan
    places[30], places[31] = 1.5e308, -1.5e308
    assert [each.level for each in plausibility.speed("trans", places, np.arange(50) / 60)] == ["odd"]
    assert plausibility.speed("trans", np.full((5, 3), np.inf), np.arange(5.0)) == []
    assert not recwarn
