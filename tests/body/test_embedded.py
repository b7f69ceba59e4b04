"""The embedded bodies: golden numbers (trimesh as judge), the same joints in both, shapes that stay people."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import ipman_rs as ip
from ipman_rs.body import joints

trimesh = pytest.importorskip("trimesh")
NAMES = ("anny", "anny-lite")


def solid(body, vertices):
    return trimesh.Trimesh(vertices, body.faces, process=False)


def test_size_of_the_files():
    files = sorted((Path(ip.body.__file__).parent / "data").glob("*.npz"))
    assert [file.name for file in files] == ["anny-lite.npz", "anny.npz"]
    assert sum(file.stat().st_size for file in files) < 1_500_000


@pytest.mark.parametrize(("name", "num_vertices", "num_faces"), [("anny", 12_272, 24_540), ("anny-lite", 1229, 2454)])
def test_shape_of_the_arrays(name, num_vertices, num_faces):
    body = ip.load_body(name)
    assert (body.num_vertices, len(body.faces), body.num_joints, body.num_betas) == (num_vertices, num_faces, 24, 10)
    assert body.joint_names == joints.SMPL
    assert tuple(body.parents) == joints.SMPL_PARENTS
    assert body.up == "y"
    np.testing.assert_allclose(body.weights.sum(1), 1.0, atol=1e-15)
    assert ip.load_body(name) is body


@pytest.mark.parametrize(("name", "litres"), [("anny", 65.0), ("anny-lite", 62.9)])  # the light mesh cuts corners
def test_mean_adult(name, litres):
    """1.69 m and 65 litres (64 kg at 985 kg/m3), closed, outward, feet on the floor, arms level, facing +z."""
    body = ip.load_body(name)
    vertices, places = body().vertices, dict(zip(body.joint_names, body().joints, strict=True))
    mesh = solid(body, vertices)
    assert mesh.is_watertight
    assert mesh.is_winding_consistent
    assert mesh.body_count == 1
    height = vertices[:, 1].max() - vertices[:, 1].min()
    assert height == pytest.approx(1.687, abs=0.005)
    assert mesh.volume == pytest.approx(litres / 1000, abs=1e-4)
    assert 0 <= vertices[:, 1].min() < 2e-3  # the floor is that of the full mesh
    assert places["pelvis"] == pytest.approx([0.0, 0.898, 0.0], abs=1e-3)
    assert places["left_wrist"][0] > places["left_elbow"][0] > places["left_shoulder"][0] > 0
    assert places["left_wrist"][1:] == pytest.approx(places["left_shoulder"][1:], abs=1e-3)
    assert places["left_foot"][2] > places["left_ankle"][2] + 0.1


@pytest.mark.parametrize("name", NAMES)
def test_volume_of_the_engine_is_trimesh_s(name):
    body = ip.load_body(name)
    vertices = body().vertices
    assert ip.part_volumes(vertices, body.template).sum() == pytest.approx(solid(body, vertices).volume, rel=1e-12)
    assert body.template.num_parts == 10
    assert body.template.num_samples == 20_000
    assert body.template.watertight
    np.testing.assert_array_equal(body.template.vertices, vertices)


def test_both_resolutions_share_joints_and_shape():
    full, light = ip.load_body("anny"), ip.load_body("anny-lite")
    rng = np.random.default_rng(0)
    pose, betas = 0.3 * rng.normal(size=(5, 24, 3)), rng.normal(size=(5, 10))
    a, b = full(pose, betas), light(pose, betas)
    np.testing.assert_array_equal(a.joints, b.joints)
    for fine, coarse in zip(a.vertices, b.vertices, strict=True):
        distance = trimesh.proximity.ProximityQuery(solid(full, fine)).vertex(coarse)[0]
        assert distance.mean() < 0.006  # half the mean edge of the full mesh


@pytest.mark.parametrize("name", NAMES)
def test_shapes_are_people(name):
    """Two standard deviations along any component: 1.3 to 2.1 m, 30 to 150 litres, soles within 3 cm of the floor."""
    body = ip.load_body(name)
    for component in range(10):
        for amount in (-2.0, 2.0):
            vertices = body(betas=amount * np.eye(10)[component]).vertices
            assert 1.3 < np.ptp(vertices[:, 1]) < 2.1
            assert 0.03 < solid(body, vertices).volume < 0.15
            assert abs(vertices[:, 1].min()) < 0.03


def test_first_components_are_height_and_weight():
    body = ip.load_body("anny")
    height = [np.ptp(body(betas=b).vertices[:, 1]) for b in ([-1.0], [1.0])]
    volume = [solid(body, body(betas=b).vertices).volume for b in ([0.0, -1.0], [0.0, 1.0])]
    assert abs(height[1] - height[0]) > 0.15
    assert abs(volume[1] - volume[0]) > 0.01


def test_rotating_the_root_turns_the_whole_body():
    body = ip.load_body("anny-lite")
    pose = np.zeros((24, 3))
    pose[0] = [0.0, np.pi / 2, 0.0]
    start, end = body(), body(pose)
    pelvis = start.joints[0]
    turned = (start.vertices - pelvis)[:, [2, 1, 0]] * [1, 1, -1] + pelvis  # a quarter turn to the left: z to x
    np.testing.assert_allclose(end.vertices, turned, atol=1e-14)
