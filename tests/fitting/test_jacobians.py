"""Closed Jacobians of least-squares terms against forward mode, which knows nothing of them."""

from dataclasses import replace

import pytest
import torch

from ipman_rs.fitting import variables
from ipman_rs.fitting.objective import Objective
from ipman_rs.fitting.terms import TERMS
from tests.helpers import fit_terms_cases as cases

FREE = ("orient", "pose", "betas", "transl", "camera_orient", "camera_transl", "log_focal")


CASES = [("reprojection", None), ("reprojection", 0.3), ("points_3d", None), ("points_3d", 0.3)]
CASES += [("pose_prior", None), ("shape_prior", None), ("joint_limits", None)]
CASES += [("bone_directions", None), ("bone_directions", 2.0), ("flat_soles", None), ("flat_soles", 0.3)]
CASES += [("segment_balance", None), ("seat", None)]
FEEL_CAMERA = ("bone_directions",)  # and leave its turning to forward mode


@pytest.mark.parametrize(("name", "rho"), CASES)
@pytest.mark.parametrize("free", [FREE, ("log_focal", "betas"), ("camera_orient", "pose")])
def test_closed_jacobians(name, free, rho):
    if name in FEEL_CAMERA:
        free = tuple(block for block in free if block != "camera_orient")
    problem, given = cases.observed(3)
    problem = replace(problem, **cases.held(3, len(problem.landmarks.names)))
    options = {name: {"rho": rho}} if rho else {}
    objective = Objective(problem, given, free, {name: 2.0}, options)
    points = variables.pack(given, free).numpy()
    values, slopes = objective._jacobian(points, [name])
    expected, expected_slopes = objective._by_forward_mode(points, [name])
    assert objective.terms[name].linearised(objective.candidate(torch.from_numpy(points)), free) is not None
    torch.testing.assert_close(values, expected, rtol=1e-12, atol=1e-12)
    assert expected_slopes.abs().max() > 0 or name in ("pose_prior", "shape_prior", "joint_limits")
    torch.testing.assert_close(slopes, expected_slopes, rtol=0, atol=1e-10 * max(1.0, expected_slopes.abs().max()))
    for body in range(3):
        row = objective.rows([body])
        alone = row._jacobian(points[body : body + 1], [name])
        assert torch.equal(alone[0][0], values[body])
        assert torch.equal(alone[1][0], slopes[body])


def test_bones_before_a_camera_that_turns_go_by_forward_mode():
    problem, given = cases.observed(3)
    problem = replace(problem, **cases.held(3, len(problem.landmarks.names)))
    objective = Objective(problem, given, ("camera_orient",), {"bone_directions": 2.0})
    points = variables.pack(given, ("camera_orient",)).numpy()
    assert objective.terms["bone_directions"].linearised(objective.candidate(torch.from_numpy(points)), FREE) is None
    slopes = objective._jacobian(points, ["bone_directions"])[1]
    assert slopes.abs().amax(dim=(1, 2)).min() > 0.1


def test_every_term_has_a_name():
    assert all(name == name.lower() for name in TERMS)
