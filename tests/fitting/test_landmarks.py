"""Named points: where they are, and that posing a few vertices is posing the body."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

torch = pytest.importorskip("torch", reason="torch is an extra")

import ipman_rs as ip  # noqa: E402
import ipman_rs.torch as ipt  # noqa: E402
from ipman_rs.body.landmarks import ends, point_rows, skin_points  # noqa: E402
from ipman_rs.fitting.landmarks import Landmarks, Site, landmark_names  # noqa: E402


@pytest.fixture(scope="module", params=["anny", "anny-lite"])
def body(request):
    return ipt.BodyModel(request.param, torch.float64)


@pytest.fixture(scope="module")
def landmarks(body):
    return Landmarks(body)


def people(body, count, dtype=torch.float64):
    generator = torch.Generator().manual_seed(3)
    shapes = (count, body.body.num_joints, 3), (count, body.body.num_betas), (count, 3)
    pose, betas, transl = (torch.randn(shape, generator=generator, dtype=torch.float64) for shape in shapes)
    return (0.4 * pose).to(dtype), betas.to(dtype), transl.to(dtype)


def test_points_of_the_whole_body(body, landmarks):
    people_ = people(body, 3)
    found = landmarks(*people_)
    posed = body(*people_)
    assert found.shape == (3, len(landmarks.names), 3)
    vertices = skin_points(body.body)
    for name, points in zip(landmarks.names, found.unbind(1), strict=True):
        if name in body.body.joint_names:
            expected = posed.joints[:, body.body.joint_names.index(name)]
        elif name in vertices:
            expected = posed.vertices[:, vertices[name]]
        else:
            assert name in ("mid_hip", "mid_shoulder")
            sides = [body.body.joint_names.index(f"{side}_{name[4:]}") for side in ("left", "right")]
            expected = posed.joints[:, sides].mean(1)
        torch.testing.assert_close(points, expected, rtol=0, atol=1e-14)


# Where a person of 1.69 m has them, T-pose, metres: read off pictures of the mesh. 15 mm: the coarse mesh's edges.
PLACES = {
    "nose": (0, 1.538, 0.156),
    "head_top": (0, 1.686, 0.03),
    "left_eye": (0.031, 1.571, 0.129),
    "left_ear": (0.085, 1.562, 0.026),
    "left_heel": (0.186, 0.025, -0.063),
    "left_big_toe": (0.155, 0.015, 0.192),
    "left_small_toe": (0.236, 0.012, 0.146),
    "left_index_tip": (0.838, 1.336, 0.07),
    "left_pinky_tip": (0.813, 1.331, -0.038),
    "left_thumb_tip": (0.755, 1.284, 0.094),
    "left_index": (0.745, 1.342, 0.044),
}


SIDES = [(name, 1) for name in PLACES] + [(name, -1) for name in PLACES if name.startswith("left_")]


@pytest.mark.parametrize(("name", "sign"), SIDES)
def test_place_on_the_mean_body(landmarks, name, sign):
    x, y, z = PLACES[name]
    side = name if sign > 0 else name.replace("left_", "right_")
    point = landmarks(torch.zeros(1, 24, 3, dtype=torch.float64))[0, landmarks.names.index(side)]
    away = point - torch.tensor([sign * x, y, z], dtype=torch.float64)
    assert away.norm() < (0.022 if name == "head_top" else 0.017)


def test_a_row_does_not_know_its_batch(body, landmarks):
    rows = people(body, 5, torch.float32)
    together = landmarks(*rows)
    for index in range(5):
        assert torch.equal(landmarks(*(value[index : index + 1] for value in rows))[0], together[index])


def test_gradients(body):
    landmarks = Landmarks(body, ["nose", "mid_hip", "left_wrist", "right_heel"])
    rows = tuple(value.requires_grad_() for value in people(body, 2))
    assert torch.autograd.gradcheck(landmarks, rows, check_forward_ad=True)


def test_sites_move_with_the_skin(body):
    # A shifted site is a point of the resting mesh: two of them keep their distance where the skin turns rigidly.
    vertex = int(np.flatnonzero(body.body.weights.max(1) > 0.9999)[0])
    sites = {"a": Site(vertex), "b": Site(vertex, (0.0, 0.03, 0.04)), "c": "nose"}
    landmarks = Landmarks(body, ["b", "a", "c", "nose"], sites)
    b, a, c, nose = landmarks(*people(body, 4)).unbind(1)
    torch.testing.assert_close((b - a).norm(dim=-1), torch.full((4,), 0.05, dtype=torch.float64), rtol=1e-4, atol=0)
    assert torch.equal(c, nose)
    assert torch.equal(a, body(*people(body, 4)).vertices[:, vertex])


def test_joints_alone(body):
    landmarks = Landmarks(body, ["head"])
    assert landmarks(*people(body, 2)).shape == (2, 1, 3)


def test_an_unknown_name(body):
    with pytest.raises(ValueError, match=r"names: the body 'anny.*no landmark 'tail'; it has pelvis, "):
        Landmarks(body, ["nose", "tail"])
    assert "nose" in landmark_names(body.body)


def test_pose_blend_shapes_and_finger_joints(body):
    # As in an SMPL+H file: pose blend shapes, and joints of the fingers, here one of them at the index finger's tip.
    given = body.body
    tip = given.v_template[skin_points(given)["left_index_tip"]]
    joints = given.num_joints
    weights = np.concatenate([given.weights, np.zeros((given.num_vertices, 1))], axis=1)
    near = np.linalg.norm(given.v_template - tip, axis=1) < 0.03
    weights[near] = np.eye(joints + 1)[joints]
    smplh = dataclasses.replace(
        given,
        name="with fingers",
        posedirs=1e-3 * np.random.default_rng(5).normal(size=(given.num_vertices, 3, 9 * joints)),
        J_template=np.vstack([given.J_template, tip - [0.02, 0, 0]]),
        J_shapedirs=np.concatenate([given.J_shapedirs, given.J_shapedirs[:1]]),
        J_expressiondirs=np.zeros((joints + 1, 3, 0)),
        rest_rotation=np.concatenate([given.rest_rotation, given.rest_rotation[22:23]]),
        weights=weights,
        parents=np.append(given.parents, given.joint_names.index("left_hand")),
        joint_names=(*given.joint_names, "left_index3"),
    )
    torch_body = ipt.BodyModel(smplh, torch.float64)
    landmarks = Landmarks(torch_body, ["left_index_tip", "left_index3", "nose"])
    posed = torch_body(*people(torch_body, 2))
    vertices = skin_points(smplh)
    assert near[vertices["left_index_tip"]]
    expected = [posed.vertices[:, vertices[name]] for name in ("left_index_tip", "nose")]
    found = landmarks(*people(torch_body, 2))
    torch.testing.assert_close(found[:, [0, 2]], torch.stack(expected, 1), rtol=0, atol=1e-14)
    torch.testing.assert_close(found[:, 1], posed.joints[:, -1], rtol=0, atol=1e-14)


def test_a_name_means_a_point_or_the_midpoint_of_two():
    """The knee's row among vertices and joints is where the posed body has its knee; the nose is in front."""
    lite = ip.load_body("anny-lite")
    rows, posed = point_rows(lite), lite()
    points = np.concatenate([posed.vertices, posed.joints])
    np.testing.assert_array_equal(points[rows["left_knee"]], posed.joints[lite.joint_names.index("left_knee")])
    head = points[rows["head"]]
    assert points[rows["nose"], 2] > head[2] + 0.05
    assert ends(["mid_hip", "nose"], rows, "lite") == [("left_hip", "right_hip"), ("nose", "nose")]
    assert ends(["mid_hip"], {"mid_hip": 0}, "lite") == [("mid_hip", "mid_hip")]  # a point of that name comes first
    with pytest.raises(ValueError, match="keypoints: the body 'lite' has no landmark 'left_hip'; it has nose, mid_hip"):
        ends(["mid_hip"], ["nose"], "lite", "keypoints")
