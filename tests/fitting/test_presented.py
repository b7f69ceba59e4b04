"""Presented poses, by name and from files: bodies as `ipman demo` draws them, on their floors, touching themselves."""

from __future__ import annotations

import json
import pickle
import re

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import ipman_rs as ip
from ipman_rs.body import poses
from ipman_rs.fitting import presented
from tests.helpers.miniatures import models

LITE = {"pose": np.zeros((1, 72)), "model": np.array("anny-lite")}


@pytest.fixture(scope="module")
def smplx(tmp_path_factory):
    path = tmp_path_factory.mktemp("models") / "SMPLX_NEUTRAL.npz"
    models.smplx(path)
    return ip.load_body(path)


@pytest.mark.parametrize("name", poses.NAMES)
def test_a_named_pose_stands_as_the_demo_draws_it(name, lite):
    """The root keeps its rotation: without it lying bodies were 1.75 m tall."""
    found = presented.load(name, lite)
    drawn = ip.body.posed(lite, name)
    shown = found.vertices(lite)
    # Both pose the same body; the demo's is moved onto y = 0.
    np.testing.assert_allclose(shown[:, 1] - found.floor(lite), drawn[:, 1], atol=1e-12)
    np.testing.assert_allclose(shown[:, [0, 2]], drawn[:, [0, 2]], atol=1e-12)
    record = found.record(lite)
    assert record["body_height_m"] == pytest.approx(np.ptp(drawn[:, 1]), abs=1e-12)
    assert abs(record["lowest_above_floor_m"]) < 1e-12


def test_contact_is_found_where_parts_touch(lite):
    """In the tree pose the right foot stands on the left leg; nobody touches themselves with their arms out."""
    owner = np.array(lite.joint_names)[lite.weights.argmax(axis=1)]
    tree = presented.load("tree", lite)
    assert {*owner[tree.contact]} == {"left_knee", "right_ankle", "right_foot"}
    assert tree.contact_from == "mesh"
    t_pose = presented.load("t_pose", lite)
    assert len(t_pose.contact) == 0
    assert "nothing touches in it" in t_pose.notes[0]


def test_distance_to_opposite_surface_is_trimeshs(lite):
    """Signed distances of the squat's vertices, against the nearest points that trimesh finds on the other parts."""
    import trimesh

    vertices = ip.body.posed(lite, "squat")
    found = ip.self_contact_distance(vertices, lite.template, near=0.05)
    touching = np.flatnonzero(np.isfinite(found))
    assert len(touching) > 50
    edges = trimesh.Trimesh(lite.template.vertices, lite.faces, process=False).edges_unique
    from scipy.sparse import csr_array
    from scipy.sparse.csgraph import dijkstra

    lengths = np.linalg.norm(np.diff(lite.template.vertices[edges], axis=1)[:, 0], axis=1)
    graph = csr_array((lengths, edges.T), shape=(len(vertices),) * 2)
    along = dijkstra(graph, directed=False, indices=touching)
    for vertex, from_there in zip(touching, along, strict=True):
        opposite = lite.faces[(from_there[lite.faces] > 0.3).all(axis=1)]
        triangles = vertices[opposite]
        nearest = trimesh.triangles.closest_point(triangles, np.tile(vertices[vertex], (len(triangles), 1)))
        expected = np.linalg.norm(nearest - vertices[vertex], axis=1).min()
        assert abs(found[vertex]) == pytest.approx(expected, abs=1e-9)


def stored(body, pose, betas=None, transl=None, turn=None, **more):
    """A file's arrays of a pose (J, 3) in the names of smplx, turned about the world's origin."""
    root = Rotation.from_rotvec(pose[0])
    transl = np.zeros(3) if transl is None else transl
    pelvis = body.J_template[0] + (0 if betas is None else body.J_shapedirs[0] @ betas)
    if turn is not None:
        root, transl = turn * root, turn.apply(pelvis + transl) - pelvis
    return {
        "global_orient": root.as_rotvec()[None], "body_pose": pose[None, 1:24].reshape(1, -1), "transl": transl[None],
        **({} if betas is None else {"betas": betas[None]}), "model": np.array(body.name), **more,
    }  # fmt: skip


@pytest.mark.parametrize("ending", ["npz", "pkl"])
def test_a_file_with_its_own_ground_and_contact(ending, lite, tmp_path):
    """In a world with another up and origin: the body stands as high above its floor as in the file."""
    pose = poses.pose_of(lite, "plank")
    betas = np.linspace(-1, 1, lite.num_betas)
    transl = np.array([0.3, 0.9, -2.0])
    own = np.asarray(lite(pose, betas, transl).vertices)
    floor = own[:, 1].min() - 0.02  # the body hovers 2 cm over the file's floor
    turn = Rotation.from_rotvec([0.7, -0.4, 1.1])
    normal = turn.apply([0.0, 1.0, 0.0])
    arrays = stored(
        lite, pose, betas, transl, turn, ground=np.array([*normal, floor]), contact=np.array([[3, 9], [9, 4]])
    )
    path = tmp_path / f"plank.{ending}"
    if ending == "npz":
        np.savez(path, **arrays)
    else:
        path.write_bytes(pickle.dumps({**arrays, "model": lite.name}))
    found = presented.load(path, lite)
    assert found.contact.tolist() == [3, 4, 9]
    assert found.contact_from == "file"
    # The pelvis is as high above the floor as in the file; the heading is free.
    pelvis = lite.J_template[0] + lite.J_shapedirs[0] @ betas + transl
    assert lite.J_template[0, 1] - found.height == pytest.approx(pelvis[1] - floor, abs=1e-12)
    shown = lite(found.pose, betas).vertices
    np.testing.assert_allclose(np.ptp(shown[:, 1]), np.ptp(own[:, 1]), atol=1e-9)


def test_a_fitted_body_can_be_presented(lite, tmp_path):
    """What `ipman fit` writes is a presented pose: the same height above the same floor."""
    pose = poses.pose_of(lite, "squat")
    lowest = float(lite(pose).vertices[:, 1].min())
    np.savez(
        tmp_path / "fit.npz", **stored(lite, pose, transl=np.array([0.0, 0.5, 1.0])),
        ground_normal=np.array([[0.0, 1.0, 0.0]]), ground_height=np.array([lowest + 0.5]),
    )  # fmt: skip
    found = presented.load(tmp_path / "fit.npz", lite)
    assert found.record(lite)["lowest_above_floor_m"] == pytest.approx(0.0, abs=1e-12)
    np.testing.assert_allclose(found.pose, pose, atol=1e-12)
    assert found.contact.tolist() == presented.load("squat", lite).contact.tolist()


def test_another_body_s_floor_and_contact_do_not_count(lite, smplx, tmp_path):
    pose = poses.pose_of(smplx, "lunge")
    np.savez(
        tmp_path / "shown.npz", fullpose=(pose + smplx.pose_mean)[None], transl=np.zeros((1, 3)),
        ground=np.array([0.0, 0.0, 1.0, -5.0]), contact=np.array([4, 5]),
    )  # fmt: skip
    found = presented.load(tmp_path / "shown.npz", lite, up=(0.0, 1.0, 0.0))
    assert found.height is None
    assert "is of another body than anny-lite" in found.notes[0]
    np.testing.assert_allclose(found.pose[:22], pose[:22], atol=1e-12)
    own = presented.load(tmp_path / "shown.npz", smplx)  # its floor is below z
    assert own.height is not None
    assert own.contact.tolist() == [4, 5]
    np.testing.assert_allclose(own.pose[25:], 0.0, atol=1e-12)  # absolute hands, less the mean hand


def test_hands_as_weights_of_components(smplx, tmp_path):
    """Upstream stores 12 numbers a hand."""
    weights = np.linspace(-0.5, 0.5, 12)
    np.savez(
        tmp_path / "shown.npz",
        body_pose=np.zeros((1, 63)),
        left_hand_pose=weights[None],
        right_hand_pose=-weights[None],
    )
    found = presented.load(tmp_path / "shown.npz", smplx)
    np.testing.assert_allclose(found.pose[25:40].ravel()[:12], weights)
    np.testing.assert_allclose(found.pose[40:].ravel()[:12], -weights)


@pytest.mark.parametrize("ending", [".json", ".npz"])
def test_a_contact_file_goes_before_all_else(ending, lite, tmp_path):
    path = tmp_path / f"touch{ending}"
    if ending == ".json":
        path.write_text(json.dumps({"contact": [7, 5, 7]}))
    else:
        flags = np.zeros(lite.num_vertices, bool)
        flags[[5, 7]] = True
        np.savez(path, contact=flags)
    found = presented.load("tree", lite, contact=path)
    assert (found.contact.tolist(), found.contact_from) == ([5, 7], "given")


@pytest.mark.parametrize(
    ("arrays", "says"),
    [
        ({"vertices": np.zeros((4, 3))}, "expected a pose such as"),
        ({"global_orient": np.zeros((3, 3)), "body_pose": np.zeros((3, 69))}, "holds 3 poses"),
        ({"body_pose": np.zeros((1, 60))}, "body_pose has shape (1, 60)"),
        ({"body_pose": np.full((1, 69), np.nan)}, "not finite"),
        ({"pose": np.zeros((1, 72)), "model": np.array("anny-lite"), "contact": np.array([5000])}, "0 to 1228"),
        (
            {"pose": np.zeros((1, 72)), "model": np.array("anny-lite"), "contact": np.array([0.5])},
            "indices of vertices",
        ),
        ({"pose": np.zeros((1, 72)), "model": np.array("anny-lite"), "ground": np.zeros(3)}, "(4,)"),
    ],
)
def test_files_that_are_no_presented_pose(arrays, says, lite, tmp_path):
    np.savez(tmp_path / "shown.npz", **arrays)
    with pytest.raises(ValueError, match=re.escape(says)):
        presented.load(tmp_path / "shown.npz", lite)


@pytest.mark.parametrize(("name", "says"), [("nonsense", "no pose 'nonsense'"), ("absent.npz", "no such file")])
def test_no_pose_and_no_file(name, says, lite):
    with pytest.raises(ValueError, match=says):
        presented.load(name, lite)


def test_a_pickle_runs_nothing(lite, tmp_path):
    class Evil:
        def __reduce__(self):
            return (open, (str(tmp_path / "ran"), "w"))

    (tmp_path / "evil.pkl").write_bytes(pickle.dumps({"pose": np.zeros((1, 72)), "x": Evil()}))
    with pytest.raises(ValueError, match="cannot be read"):
        presented.load(tmp_path / "evil.pkl", lite)
    assert not (tmp_path / "ran").exists()


def test_one_of_several_poses(lite, tmp_path):
    rows = np.stack([poses.pose_of(lite, name) for name in ("tree", "squat")]).reshape(2, -1)
    np.savez(tmp_path / "two.npz", pose=rows, model=np.array("anny-lite"))
    found = presented.load(tmp_path / "two.npz", lite, frame=1)
    np.testing.assert_allclose(found.pose, poses.pose_of(lite, "squat"), atol=1e-12)


def test_predictions_are_presented_as_they_stand(smplx, tmp_path):
    """The form of `ipman evaluate`: axes of a data set with a ground for each frame, and fingers that are absolute."""
    pose = np.stack([poses.pose_of(smplx, name) for name in ("standing", "squat")])
    turn = Rotation.from_rotvec([np.pi / 2, 0, 0])  # y up to z up
    turned = pose + smplx.pose_mean
    turned[:, 0] = (turn * Rotation.from_rotvec(pose[:, 0])).as_rotvec()
    lowest = [float(smplx(each).vertices[:, 1].min()) for each in pose]
    pelvis = smplx.J_template[0]
    transl = np.tile(turn.apply(pelvis) - pelvis, (2, 1))
    told = {"names": np.array(["a", "b"]), "body": np.array("smplx"), "pose": turned, "transl": transl}
    np.savez(tmp_path / "grounded.npz", **told, ground=np.array([[0, 0, 1, height] for height in lowest]))
    found = presented.load(tmp_path / "grounded.npz", smplx, frame=1)
    np.testing.assert_allclose(found.pose, pose[1], atol=1e-9)
    assert found.record(smplx)["lowest_above_floor_m"] == pytest.approx(0.0, abs=1e-9)
    np.savez(tmp_path / "bare.npz", **told)
    with pytest.raises(ValueError, match="say what points up"):
        presented.load(tmp_path / "bare.npz", smplx, frame=1)
    by_hand = presented.load(tmp_path / "bare.npz", smplx, frame=1, up=(0.0, 0.0, 1.0))
    np.testing.assert_allclose(by_hand.pose, pose[1], atol=1e-9)


def test_components_of_hands_are_those_of_the_frame(smplx, tmp_path):
    """Each hand by itself, and of the frame that is presented."""
    np.savez(
        tmp_path / "shown.npz", body_pose=np.zeros((3, 63)), left_hand_pose=np.arange(36).reshape(3, 12) / 100,
        right_hand_pose=np.full((3, 45), 0.2),
    )  # fmt: skip
    found = presented.load(tmp_path / "shown.npz", smplx, frame=2)
    np.testing.assert_allclose(found.pose[25:40].ravel()[:12], np.arange(24, 36) / 100)
    np.testing.assert_allclose(found.pose[40:], 0.2)


def test_a_height_alone_is_a_floor(lite, tmp_path):
    """As the parameters of a fitted sequence have it."""
    np.savez(tmp_path / "shown.npz", **LITE, ground_height=np.array([-1.5]))
    assert presented.load(tmp_path / "shown.npz", lite).height == pytest.approx(-1.5)


def test_fingers_without_a_jaw_may_be_smplx(smplx, tmp_path):
    pieces = {"global_orient": np.zeros(3), "body_pose": np.zeros(63)}
    hands = {"left_hand_pose": np.zeros(45), "right_hand_pose": np.zeros(45)}
    np.savez(tmp_path / "shown.npz", **pieces, **hands, ground=np.array([0, 1, 0, -1.2]), contact=np.array([[1, 2]]))
    found = presented.load(tmp_path / "shown.npz", smplx)
    assert (found.height, found.contact.tolist()) == (pytest.approx(-1.2), [1, 2])


@pytest.mark.parametrize(
    ("arrays", "says"),
    [
        ({"pose": np.full((1, 72), 20.0)}, "looks like degrees"),
        ({"pose": np.full((1, 72), 1e30)}, "looks like degrees"),
        ({**LITE, "ground": np.array([0, 1, 0, -900.0])}, "in metres?"),
        ({**LITE, "ground": np.array([0, 0, 0, 1.0])}, "a finite normal that is not 0"),
        ({**LITE, "ground": np.array([0, 1, 0, np.nan])}, "a finite normal that is not 0"),
        ({**LITE, "ground": np.array([0, 1, 0, 0]), "transl": np.full((1, 3), np.nan)}, "transl: expected finite"),
        ({**LITE, "ground": np.array([0, 1, 0, 0]), "transl": np.zeros((0, 3))}, "transl: expected finite"),
        ({**LITE, "ground": np.array([0, 1, 0, 0]), "betas": np.array(1.0)}, "betas: expected finite"),
    ],
)
def test_what_cannot_be_is_refused(arrays, says, lite, tmp_path):
    np.savez(tmp_path / "shown.npz", **arrays)
    with pytest.raises(ValueError, match=re.escape(says)) as raised:
        presented.load(tmp_path / "shown.npz", lite)
    assert str(tmp_path / "shown.npz") in str(raised.value)


def test_options_of_files_do_not_go_with_names(lite):
    with pytest.raises(ValueError, match="leave out `pose_frame`"):
        presented.load("tree", lite, frame=3)


def test_infinite_contact(lite, tmp_path):
    (tmp_path / "touch.json").write_text("[1, Infinity]")
    with pytest.raises(ValueError, match="whole numbers"):
        presented.load("tree", lite, contact=tmp_path / "touch.json")
