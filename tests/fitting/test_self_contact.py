"""The terms of self-contact in a fit: what they cost, that rows are alone, and that a descent takes an arm out."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
import torch

import ipman_rs as ip
import ipman_rs.torch as ipt
from ipman_rs.fitting.candidate import Candidate
from ipman_rs.fitting.terms import TERMS

F64 = torch.float64


@pytest.fixture(scope="module")
def problem() -> Any:
    """Only the body matters."""
    return SimpleNamespace(body=ipt.BodyModel("anny-lite", dtype=F64))


def arms_bent(amount: float, count: int = 1) -> torch.Tensor:
    """(count, 23, 3): the forearms bent into the trunk."""
    pose = np.broadcast_to(ip.body.poses.pose("standing"), (count, 24, 3)).copy()
    for elbow, side in ((18, -1), (19, 1)):
        pose[:, elbow, 1] += side * 1.9 * amount
        pose[:, elbow - 2, 2] += side * 0.5 * amount
    return torch.from_numpy(pose)[:, 1:]


def candidate(problem: Any, pose: torch.Tensor) -> Candidate:
    zeros = torch.zeros(len(pose), 3, dtype=pose.dtype)
    betas = torch.zeros(len(pose), problem.body.body.num_betas, dtype=pose.dtype)
    return Candidate(problem, {"orient": zeros, "pose": pose, "betas": betas, "transl": zeros})


def test_costs_are_the_losses(problem):
    looked_at = candidate(problem, arms_bent(1.0, 2))
    push, pull = ipt.self_contact_loss(looked_at.vertices, problem.body.template)
    assert (push > 1).all()
    assert (pull > 0.01).all()
    contact, penetration = TERMS["self_contact"](problem), TERMS["self_penetration"](problem)
    assert contact.needs_mesh
    assert penetration.needs_mesh
    assert torch.equal(contact.cost(looked_at), push + pull)
    assert torch.equal(penetration.cost(looked_at), push)


@pytest.mark.parametrize("name", ["self_contact", "self_penetration"])
@pytest.mark.parametrize("dtype", [torch.float32, F64])
def test_rows_are_alone(name, dtype):
    problem: Any = SimpleNamespace(body=ipt.BodyModel("anny-lite", dtype=dtype))
    term = TERMS[name](problem)
    poses = torch.cat([arms_bent(amount) for amount in (0.7, 0.0, 1.0)]).to(dtype)

    def look(rows):
        rows = rows.clone().requires_grad_()
        cost = term.cost(candidate(problem, rows))
        return cost.detach(), torch.autograd.grad(cost.sum(), rows)[0]

    together = look(poses)
    for row in range(3):
        alone = look(poses[row : row + 1])
        assert all(torch.equal(whole[row], one[0]) for whole, one in zip(together, alone, strict=True))
    assert (together[1][1] == 0).all()
    assert together[1].isfinite().all()


def test_gradient_by_the_pose(problem):
    """Central differences along random directions: faces change along a step, which gradcheck's small columns see."""
    term = TERMS["self_penetration"](problem)
    pose = arms_bent(1.0).requires_grad_()
    (gradient,) = torch.autograd.grad(term.cost(candidate(problem, pose)).sum(), pose)
    generator = torch.Generator().manual_seed(0)
    for _ in range(4):
        direction, step = torch.randn(pose.shape, generator=generator, dtype=F64), 1e-7
        ahead, behind = (term.cost(candidate(problem, pose.detach() + s * step * direction)) for s in (1, -1))
        slope = (gradient * direction).sum()
        torch.testing.assert_close((ahead - behind).sum() / (2 * step), slope, rtol=1e-5, atol=1e-4)


def test_a_descent_takes_the_arms_out(problem):
    term = TERMS["self_penetration"](problem)
    pose = arms_bent(0.8).requires_grad_()
    before = ip.self_penetration(candidate(problem, pose).vertices.detach().numpy(), problem.body.template).deepest
    assert before > 0.02
    descent = torch.optim.Adam([pose], lr=0.01)
    for _ in range(100):
        descent.zero_grad()
        cost = term.cost(candidate(problem, pose)).sum()
        if cost == 0:
            break
        cost.backward()
        descent.step()
    after = ip.self_penetration(candidate(problem, pose).vertices.detach().numpy(), problem.body.template).deepest
    assert after < 0.002
    assert (pose.detach() - arms_bent(0.8)).abs().max() < 0.5
