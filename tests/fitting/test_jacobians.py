"""Closed Jacobians of least-squares terms against forward mode, which knows nothing of them."""

import pytest
import torch

from ipman_rs.fitting import variables
from ipman_rs.fitting.objective import Objective
from ipman_rs.fitting.terms import TERMS
from tests.helpers import fit_terms_cases as cases

FREE = ("orient", "pose", "betas", "transl", "camera_orient", "camera_transl", "log_focal")


CASES = [("reprojection", None), ("reprojection", 0.3), ("points_3d", None), ("points_3d", 0.3)]
CASES += [("pose_prior", None), ("shape_prior", None), ("joint_limits", None)]


@pytest.mark.parametrize(("name", "rho"), CASES)
@pytest.mark.parametrize("free", [FREE, ("log_focal", "betas"), ("camera_orient", "pose")])
def test_closed_jacobians(name, free, rho):
    problem, given = cases.observed(3)
    options = {name: {"rho": rho}} if rho else {}
    objective = Objective(problem, given, free, {name: 2.0}, options)
    points = variables.pack(given, free).numpy()
    values, slopes = objective._jacobian(points, [name])
    expected, expected_slopes = objective._by_forward_mode(points, [name])
    assert objective.terms[name].linearised(objective.candidate(torch.from_numpy(points)), free) is not None
    torch.testing.assert_close(values, expected, rtol=1e-12, atol=1e-12)
    assert expected_slopes.abs().max() > 0 or name not in ("reprojection", "points_3d")
    torch.testing.assert_close(slopes, expected_slopes, rtol=0, atol=1e-10 * max(1.0, expected_slopes.abs().max()))
    for body in range(3):
        row = objective.rows([body])
        alone = row._jacobian(points[body : body + 1], [name])
        assert torch.equal(alone[0][0], values[body])
        assert torch.equal(alone[1][0], slopes[body])


def test_every_term_has_a_name():
    assert all(name == name.lower() for name in TERMS)
