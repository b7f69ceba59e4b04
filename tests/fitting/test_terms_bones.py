"""Directions of bones against those that a detector of 3D points has seen."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
import torch
from scipy.spatial.transform import Rotation

from ipman_rs.fitting.candidate import Candidate
from ipman_rs.fitting.problem import Problem
from ipman_rs.fitting.terms.bone_directions import BONES, BoneDirections
from tests.helpers import fit_terms_cases as cases


@pytest.fixture(scope="module")
def seen() -> tuple[Problem, dict[str, torch.Tensor]]:
    """Two bodies before turned cameras, the 3D points their own, in the camera's axes."""
    problem, given = cases.observed(2)
    body = Candidate(problem, given)
    own = torch.as_tensor(in_camera(given, body.landmarks))
    return replace(problem, relative_points=own, relative_confidence=torch.ones_like(own[..., 0])), given


def in_camera(given, points) -> np.ndarray:
    turns = Rotation.from_rotvec(given["camera_orient"].numpy()).as_matrix()
    return np.einsum("bij,bkj->bki", turns, points.numpy())


def cost(problem, given, **options) -> np.ndarray:
    return BoneDirections(problem, **options).cost(Candidate(problem, given)).numpy()


def directions(problem, points) -> np.ndarray:
    """(B, N, 3), of every bone of the list: a body with all landmarks has them all."""
    names = problem.landmarks.names
    bones = points[:, [names.index(b) for _, b in BONES]] - points[:, [names.index(a) for a, _ in BONES]]
    return bones / np.linalg.norm(bones, axis=-1, keepdims=True)


def test_there_are_sixteen_bones():
    assert len(BONES) == len(set(BONES)) == 16


def test_the_bodys_own_points_cost_nothing(seen):
    problem, given = seen
    assert cost(problem, given).max() < 1e-28


def test_lengths_and_places_are_left_out(seen):
    problem, given = seen
    moved = 0.3 * problem.relative_points + torch.tensor([5.0, -2.0, 1.0]).double()
    assert cost(replace(problem, relative_points=moved), given).max() < 1e-26
    # The place of each person, and of the camera, too.
    elsewhere = {**given, "transl": given["transl"] + 3, "camera_transl": given["camera_transl"] - 2}
    assert cost(problem, elsewhere).max() < 1e-26


@pytest.mark.parametrize("rho", [0.3, 2.0])
def test_against_the_formula(seen, rho):
    problem, given = seen
    generator = torch.Generator().manual_seed(3)
    shape = problem.relative_points.shape
    points = problem.relative_points + 0.2 * torch.randn(shape, generator=generator, dtype=torch.float64)
    confidence = torch.rand(shape[:2], generator=generator, dtype=torch.float64)
    body = in_camera(given, Candidate(problem, given).landmarks)
    squares = np.square(directions(problem, body) - directions(problem, points.numpy())).sum(axis=-1)
    names = problem.landmarks.names
    ends = [[names.index(bone[end]) for bone in BONES] for end in (0, 1)]
    certain = np.minimum(confidence.numpy()[:, ends[0]], confidence.numpy()[:, ends[1]])
    expected = (certain**2 * rho**2 * squares / (squares + rho**2)).sum(axis=-1)
    told = replace(problem, relative_points=points, relative_confidence=confidence)
    np.testing.assert_allclose(cost(told, given, rho=rho), expected, rtol=1e-12)


def test_opposite_directions(seen):
    problem, given = seen
    turned = replace(problem, relative_points=-problem.relative_points)
    expected = 16 * 0.09 * 4 / (4 + 0.09)
    np.testing.assert_allclose(cost(turned, given), expected, rtol=1e-12)


def test_unseen_bones_weigh_nothing(seen):
    problem, given = seen
    names = problem.landmarks.names
    wrist = names.index("left_wrist")
    points, confidence = problem.relative_points.clone(), problem.relative_confidence.clone()
    points[:, wrist] += 1.0
    wrong = replace(problem, relative_points=points)
    assert cost(wrong, given).min() > 0.01
    confidence[:, wrist] = 0
    assert cost(replace(wrong, relative_confidence=confidence), given).max() < 1e-28
    assert cost(replace(problem, relative_points=None), given).tolist() == [0, 0]


def test_points_that_fall_together_point_nowhere(seen):
    problem, given = seen
    term = BoneDirections(replace(problem, relative_points=torch.zeros_like(problem.relative_points)))
    assert cases.cost_and_gradient(term, given)[0].tolist() == [0, 0]
    gradients = cases.cost_and_gradient(term, given)[1].values()
    assert all(gradient.eq(0).all() for gradient in gradients)


def test_bad_options_are_refused(seen):
    with pytest.raises(ValueError, match="rho: expected positive"):
        BoneDirections(seen[0], rho=0.0)
