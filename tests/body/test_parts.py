"""The ten parts: which joint belongs to which, and that each part of the embedded body is one clean piece."""

from __future__ import annotations

from collections import Counter

import numpy as np
import pytest
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import connected_components

import ipman_rs as ip
from ipman_rs.body import joints, parts

LOOPS = {
    "head": 1,
    "torso": 5,
    "upper_arm": 2,
    "forearm": 1,
    "thigh": 2,
    "lower_leg": 1,
}  # ends where a part meets others


def test_parts_of_the_joints():
    counts = Counter(parts.part_of_joint(joint) for joint in joints.SMPLX)
    sided = {"upper_arm": 1, "forearm": 17, "thigh": 1, "lower_leg": 3}
    expected = {f"{side}_{limb}": n for limb, n in sided.items() for side in ("left", "right")} | {
        "head": 5,
        "torso": 6,
    }
    assert counts == expected
    assert parts.part_of_joint("left_collar") == "torso"
    assert parts.part_of_joint("right_hand") == "right_forearm"
    assert set(expected) == set(parts.PART_NAMES)


def test_face_label_is_the_largest_sum_over_its_vertices():
    rng = np.random.default_rng(0)
    faces = rng.integers(0, 30, (50, 3))
    weights = rng.random((30, 24)) ** 4
    labels = parts.face_parts(faces, weights, joints.SMPL)
    for face, label in zip(faces, labels, strict=True):
        sums = dict.fromkeys(parts.PART_NAMES, 0.0)
        for vertex in face:
            for joint, weight in zip(joints.SMPL, weights[vertex], strict=True):
                sums[parts.part_of_joint(joint)] += weight
        assert parts.PART_NAMES[label] == max(sums, key=sums.__getitem__)


def boundary(faces: np.ndarray) -> np.ndarray:
    """Half-edges (N, 2) of `faces` without a twin among them."""
    edges = np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]])
    present = set(map(tuple, edges.tolist()))
    return np.array([edge for edge in edges.tolist() if (edge[1], edge[0]) not in present])


def pieces(edges: np.ndarray) -> int:
    """Number of connected components that the vertices of `edges` form."""
    vertices, local = np.unique(edges, return_inverse=True)
    a, b = local.reshape(edges.shape).T
    return connected_components(coo_matrix((np.ones(len(a)), (a, b)), shape=(len(vertices), len(vertices))))[0]


@pytest.mark.parametrize("name", ["anny", "anny-lite"])
def test_each_embedded_part_is_one_piece_with_clean_ends(name):
    body = ip.load_body(name)
    assert body.part_names == parts.PART_NAMES
    meetings: Counter[int] = Counter()
    for index, part in enumerate(parts.PART_NAMES):
        faces = body.faces[body.face_parts == index]
        assert pieces(faces[:, [0, 1, 1, 2]].reshape(-1, 2)) == 1, part
        edges = boundary(faces)
        assert pieces(edges) == LOOPS[part.removeprefix("left_").removeprefix("right_")], part
        degree = np.bincount(edges.ravel())
        assert set(degree[degree > 0]) == {2}, part  # simple loops: no vertex where two ends touch
        meetings.update(np.unique(edges).tolist())
    assert set(meetings.values()) == {2}  # at every boundary vertex exactly two parts meet


@pytest.mark.parametrize("name", ["anny", "anny-lite"])
def test_parts_are_where_their_names_say(name):
    body = ip.load_body(name)
    vertices = body().vertices
    centre = {part: vertices[body.faces[body.face_parts == i]].mean((0, 1)) for i, part in enumerate(parts.PART_NAMES)}
    assert centre["head"][1] > centre["torso"][1] > centre["left_thigh"][1] > centre["left_lower_leg"][1]
    assert centre["left_forearm"][0] > centre["left_upper_arm"][0] > 0.1  # x points to the body's left
    for part in parts.PART_NAMES[2::2]:
        mirrored = centre[part.replace("left", "right")] * [-1, 1, 1]
        np.testing.assert_allclose(centre[part], mirrored, atol=5e-3)  # the mesh itself is symmetric to millimetres
