"""Units, axes, floor and cameras, judged from bodies whose truth is known."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import ipman_rs as ip
import ipman_rs.data as data
from ipman_rs.data import Cameras, Frames, check
from tests.helpers.miniatures import stick

NAMES = ("left_ankle", "right_ankle", "left_hip", "right_hip", "neck", "head")


def people(count=20, up=(0.0, 0.0, 1.0), **given):
    """People of sticks who stand on the plane through the origin."""
    rng = np.random.default_rng(1)
    joints = [[stick.joint(name, [0, 0, 0], up, heading) for name in NAMES] for heading in rng.uniform(0, 6, count)]
    fields = {"joints": np.array(joints), "joint_names": NAMES, "ground": ip.Ground(up)} | given
    return Frames(np.array([f"f{i}" for i in range(count)]), np.array(count * ["s"]), **fields)


def levels(found):
    return {each.level for each in found}


@pytest.mark.parametrize("up", [(0, 0, 1), (0, 1, 0), (0, -1, 0), (0.6, 0, 0.8)])
def test_people_who_stand_are_right(up):
    up = tuple(map(float, up))
    assert levels(check.check_frames(people(up=up))) == {"ok"}


@pytest.mark.parametrize("true", range(3))
@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_every_wrong_axis_is_named(true, sign):
    """People stand along one axis, another one is said to be up."""
    axis = np.eye(3)[true] * sign
    frames = people(up=tuple(axis.tolist()))
    for other in np.concatenate([np.eye(3), -np.eye(3)]):
        found = check.stance(frames, ip.Ground(other))
        if np.array_equal(other, axis):
            assert levels(found) == {"ok"}
        else:
            assert levels(found) == {"wrong"}
            assert f"looks like {'+' if sign > 0 else '-'}{'xyz'[true]} up" in found[0].what


def test_axes_from_the_root_of_a_body_model():
    for up, name in (((0.0, 0.0, 1.0), "+z"), ((0.0, -1.0, 0.0), "-y")):
        pose = np.zeros((20, 24, 3))
        pose[:, 0] = [stick.root(up, heading) for heading in np.linspace(0, 6, 20)]
        frames = people(joints=None, joint_names=None, pose=pose, body="smpl", ground=ip.Ground(up))
        assert levels(check.check_frames(frames)) == {"ok"}
        wrong = people(joints=None, joint_names=None, pose=pose, body="smpl", ground=ip.Ground((0, 1, 0)))
        assert any(f"pose: looks like {name} up" in each.what for each in check.check_frames(wrong))


def test_people_who_lie_give_no_verdict():
    """Lying every which way on the floor: nothing is known, nothing is claimed."""
    frames = people()
    turned = Rotation.from_rotvec([[0, np.pi / 2, 0]]).as_matrix()[0]
    lying = frames.joints @ turned.T
    spun = Rotation.from_rotvec([[0, 0, angle] for angle in np.linspace(0, 6.28, 20)]).as_matrix()
    lying = np.einsum("fij,fkj->fki", spun, lying)
    assert check.stance(people(joints=lying), ip.Ground.z_up()) == []


@pytest.mark.parametrize(
    ("factor", "unit"), [(1000, "millimetres"), (100, "centimetres"), (0.01, "no unit"), (1e5, "no unit")]
)
def test_unit_is_named(factor, unit):
    found = check.check_frames(people(joints=people().joints * factor))
    assert any(each.level == "wrong" and unit in each.what for each in found)


@pytest.mark.parametrize("size", [0.5, 0.9, 1.1, 2.2])
def test_children_and_giants_are_metres(size):
    assert levels(check.size_of_body("joints", people().joints * size)) == {"ok"}


def test_floor_of_another_height():
    for height in (-1.0, 1.0):
        found = check.check_frames(people(ground=ip.Ground.z_up(height)))
        side = "above" if height < 0 else "below"
        assert any(each.level == "wrong" and f"m {side} the ground" in each.what for each in found)


def test_a_floor_for_each_frame():
    heights = np.linspace(-3, 3, 20)
    frames = people()
    joints = frames.joints + heights[:, None, None] * (0, 0, 1)
    assert levels(check.check_frames(people(joints=joints, ground=ip.Ground.z_up(heights)))) == {"ok"}
    assert levels(check.check_frames(people(joints=joints, ground=ip.Ground.z_up(heights + 1)))) == {"ok", "wrong"}


def view(up=(0.0, 0.0, 1.0), eye=(4.0, 1.0, 1.5)):
    rotation, t = stick.camera(list(eye), [0, 0, 0.9], up)
    intrinsics = np.array([[1000.0, 0, 500], [0, 1000.0, 400], [0, 0, 1]])
    frames = people()
    pixels = [[stick.pixel(point, rotation, t, 1000.0, (500, 400)) for point in person] for person in frames.joints]
    cameras = Cameras(np.tile(rotation, (20, 1, 1)), np.tile(t, (20, 1)), np.tile(intrinsics, (20, 1, 1)))
    return cameras, np.dstack([np.array(pixels), np.ones((20, 6))])


def test_cameras_against_keypoints():
    cameras, keypoints = view()
    labelled = {"keypoints": keypoints, "keypoint_names": NAMES}
    right = check.check_frames(people(cameras=cameras, **labelled))
    assert levels(right) == {"ok"}
    assert any("lie 0.0 pixels from the keypoints" in each.what for each in right)
    inverse = Cameras(
        cameras.rotation.swapaxes(1, 2),
        -np.einsum("fji,fj->fi", cameras.rotation, cameras.translation),
        cameras.intrinsics,
    )
    for wrong in (
        inverse,
        Cameras(cameras.rotation, cameras.translation * 1000, cameras.intrinsics),
        Cameras(cameras.rotation, cameras.translation, cameras.intrinsics / (4, 4, 1)),
        Cameras(cameras.rotation * (1, -1, 1), cameras.translation, cameras.intrinsics),
        Cameras(cameras.rotation, cameras.translation + (1, 0, 0), cameras.intrinsics),
    ):
        assert "wrong" in levels(check.check_frames(people(cameras=wrong, **labelled)))


def test_nan_is_told_and_passed_over():
    joints = people().joints.copy()
    joints[3] = np.nan
    joints[4, 2, 1] = np.nan
    joints[5, 2] = np.nan  # a joint that the frame does not have
    found = check.finite_points("joints", joints)
    assert [(each.level, each.what) for each in found] == [
        ("ok", "joints: 1 of 20 frames have none"),
        ("missing", "joints: NaN or infinity among the numbers of 1 of 20 frames"),
    ]
    assert "wrong" not in levels(check.check_frames(people(joints=joints)))
    every = np.full_like(joints, np.nan)
    assert "wrong" not in levels(check.check_frames(people(joints=every)))


def test_no_frames():
    found = check.check_frames(people()[:0])
    assert [each.level for each in found] == ["wrong"]


def test_real_bodies_are_right():
    """The embedded body in its named poses: vertices and joints on the floor."""
    body = ip.load_body("anny-lite")
    vertices = np.stack([ip.body.posed(body, name) for name in ip.body.poses.NAMES])
    frames = Frames(
        np.array(ip.body.poses.NAMES), np.array(ip.body.poses.NAMES), ground=ip.Ground.y_up(), vertices=vertices
    )
    assert levels(check.check_frames(frames)) == {"ok"}
    found = check.check_frames(
        Frames(frames.names, frames.sequences, ground=ip.Ground.z_up(), vertices=1000 * vertices)
    )
    assert any("looks like millimetres" in each.what for each in found)


def test_demand_tells_all_that_is_wrong():
    found = [check.Finding("missing", "a"), check.Finding("wrong", "b", "do c"), check.Finding("wrong", "d")]
    with pytest.raises(ValueError, match=r"^some/file: b; do c\. d$"):
        check.raise_if_wrong(Path("some/file"), found)
    check.raise_if_wrong("some/file", found[:1])


def test_names_of_data_sets():
    with pytest.raises(ValueError, match="name: expected one of 3dpw, amass, .*got 'h36m'"):
        data.open("h36m", "somewhere")


def test_an_extent_beyond_double_precision_is_infinite(recwarn):
    points = np.zeros((3, 2, 3))
    points[:, 1] = 1e200, 0, 0
    assert check.extent_of(points) == np.inf
    assert check.extent_of(points * 1e-200) == pytest.approx(1.0)
    assert not recwarn
