"""Terms that are sums of squares: gradients in both modes, zeros, rows that do not know of each other, hand numbers."""

from __future__ import annotations

import math
from dataclasses import replace
from functools import partial
from types import SimpleNamespace

import pytest
import torch

from ipman_rs.body import joints
from ipman_rs.fitting.landmarks import Landmarks
from ipman_rs.fitting.problem import Presented, Problem
from ipman_rs.fitting.terms.bending import Bending
from ipman_rs.fitting.terms.bone_directions import BoneDirections
from ipman_rs.fitting.terms.flat_soles import FlatSoles
from ipman_rs.fitting.terms.gmm_prior import GaussianMixture
from ipman_rs.fitting.terms.hand_prior import HandPrior
from ipman_rs.fitting.terms.joint_limits import JointLimits
from ipman_rs.fitting.terms.points_3d import Points3D
from ipman_rs.fitting.terms.pose_prior import PosePrior
from ipman_rs.fitting.terms.presented_pose import PresentedPose
from ipman_rs.fitting.terms.seat import Seat
from ipman_rs.fitting.terms.segment_balance import SegmentBalance
from ipman_rs.fitting.terms.shape_prior import ShapePrior
from ipman_rs.fitting.terms.vposer import VPoser
from tests.helpers import fit_terms_cases as cases

DETECTED = (
    "left_shoulder", "left_elbow", "left_wrist", "left_hip", "left_knee", "left_heel", "left_big_toe", "right_hip",
)  # fmt: skip


def known(batch: int, dtype: torch.dtype = torch.float64) -> dict:
    generator = torch.Generator().manual_seed(1)
    points = torch.randn(batch, 5, 3, generator=generator, dtype=torch.float64).to(dtype)
    confidence = torch.rand(batch, 5, generator=generator, dtype=torch.float64).to(dtype)
    confidence[0, 2] = 0
    told = cases.held(batch, len(DETECTED), dtype)
    return {"points_3d": points, "confidence_3d": confidence, "presented": cases.presented(batch, dtype), **told}


def bone_directions(problem: Problem) -> BoneDirections:
    """Of the points that `relative_points` are of."""
    return BoneDirections(replace(problem, landmarks=Landmarks(problem.body, DETECTED)))


@pytest.fixture(scope="module")
def checkpoint(tmp_path_factory):
    path = tmp_path_factory.mktemp("vposer") / "vposer.ckpt"
    cases.save_vposer(path)
    return path


@pytest.fixture(
    params=["points_3d", "robust_points_3d", "joint_limits", "pose_prior", "vposer", "presented_pose", "shape_prior",
            "bending", "hand_prior", "bone_directions", "flat_soles", "segment_balance", "seat"]
)  # fmt: skip
def make(request, checkpoint):
    """problem -> term"""
    return {
        "points_3d": Points3D,
        "robust_points_3d": lambda problem: Points3D(problem, rho=0.2, weights={"head": 2.0}),
        "joint_limits": lambda problem: JointLimits(problem, margin=0.0),
        "pose_prior": PosePrior,
        "vposer": lambda problem: VPoser(problem, checkpoint),
        "presented_pose": PresentedPose,
        "shape_prior": ShapePrior,
        "bending": Bending,
        "hand_prior": HandPrior,
        "bone_directions": bone_directions,
        "flat_soles": FlatSoles,
        "segment_balance": SegmentBalance,
        "seat": Seat,
    }[request.param]


def test_gradients_in_both_modes(make):
    problem = cases.problem(1, **known(1))
    term = make(problem)
    values = cases.variables(1)

    def residuals(pose, betas, transl):
        residuals = term.residuals(cases.candidate(term.problem, pose=pose, betas=betas, transl=transl))
        return residuals[:, torch.arange(0, residuals.shape[1], max(residuals.shape[1] // 12, 1))]

    inputs = tuple(values[name].requires_grad_() for name in ("pose", "betas", "transl"))
    assert torch.autograd.gradcheck(residuals, inputs, check_forward_ad=True, fast_mode=True)


def test_the_cost_is_the_sum_of_squares(make):
    problem = cases.problem(3, **known(3))
    term = make(problem)
    body = cases.candidate(term.problem, **cases.variables(3))
    residuals = term.residuals(body)
    assert residuals.ndim == 2
    torch.testing.assert_close(term.cost(body), residuals.square().sum(dim=1), rtol=1e-15, atol=0)


@pytest.mark.parametrize("dtype", [torch.float32, torch.float64])
def test_rows_are_alone(make, dtype):
    cases.assert_rows_are_alone(make, cases.problem(6, dtype, **known(6, dtype)), cases.variables(6, dtype))


def test_zeros_have_finite_gradients_in_both_modes(make):
    problem = cases.problem(2, **known(2))
    term = make(problem)
    _, gradients = cases.cost_and_gradient(term, cases.zeros())
    assert all(gradient.isfinite().all() for gradient in gradients.values())
    tangents = cases.variables()
    with torch.autograd.forward_ad.dual_level():
        dual = {
            name: torch.autograd.forward_ad.make_dual(value, tangents[name]) for name, value in cases.zeros().items()
        }
        residuals = term.residuals(cases.candidate(term.problem, **dual))
        tangent = torch.autograd.forward_ad.unpack_dual(residuals).tangent
    assert tangent is None or tangent.isfinite().all()


def test_points_by_hand():
    problem = cases.problem(1)
    values = cases.zeros(1)
    at = problem.landmarks(torch.zeros(1, 24, 3).double(), values["betas"], values["transl"])
    points = at.clone()
    points[0, 1] += torch.tensor([0.3, 0.0, 0.4], dtype=torch.float64)  # the head, 0.5 m off
    points[0, 2, 1] += 0.1
    confidence = torch.tensor([[1.0, 0.5, 1.0, 1.0, 0.0]], dtype=torch.float64)
    points[0, 4] += 7.0  # not seen
    problem = cases.problem(1, points_3d=points, confidence_3d=confidence)
    body = cases.candidate(problem, **values)
    assert Points3D(problem).cost(body).item() == pytest.approx(0.25 * 0.25 + 0.01, rel=1e-12)
    assert Points3D(problem, weights={"head": 2.0}).cost(body).item() == pytest.approx(0.25 + 0.01, rel=1e-12)
    robust = 0.25 * 0.04 * 0.25 / (0.25 + 0.04) + 0.04 * 0.01 / (0.01 + 0.04)
    assert Points3D(problem, rho=0.2).cost(body).item() == pytest.approx(robust, rel=1e-12)
    unweighted = cases.problem(1, points_3d=points)
    assert Points3D(unweighted).cost(body).item() == pytest.approx(0.25 + 0.01 + 3 * 49, rel=1e-12)


def test_bending_punishes_overextension():
    def cost(joint: str, axis: int, angle: float) -> float:
        pose = cases.zeros(1)["pose"]
        pose[0, joints.SMPL.index(joint) - 1, axis] = angle
        problem = cases.problem(1)
        return Bending(problem).cost(cases.candidate(problem, pose=pose)).item()

    for joint, axis, bent in (("left_knee", 0, 1), ("right_knee", 0, 1), ("left_elbow", 1, -1), ("right_elbow", 1, 1)):
        assert cost(joint, axis, bent * 0.7) == pytest.approx(3 + math.exp(-1.4), rel=1e-12)
        assert cost(joint, axis, -bent * 0.7) == pytest.approx(3 + math.exp(1.4), rel=1e-12)


def test_presented_pose_leaves_hands_out():
    shown = cases.presented()
    problem = cases.problem(1, presented=shown)
    pose = shown.pose.clone()
    pose[0, joints.SMPL.index("left_knee") - 1] += torch.tensor([0.1, 0.2, 0.2], dtype=torch.float64)
    pose[0, joints.SMPL.index("left_hand") - 1] += 1.0
    body = cases.candidate(problem, pose=pose)
    assert PresentedPose(problem).cost(body).item() == pytest.approx(0.09, rel=1e-12)


def test_hand_prior_looks_at_hands_alone():
    pose = cases.variables(1)["pose"]
    problem = cases.problem(1)
    body = cases.candidate(problem, pose=pose)
    assert HandPrior(problem).cost(body).item() == pytest.approx(pose[0, 21:].square().sum().item(), rel=1e-14)


def test_shape_prior_is_the_sum_of_squares():
    problem = cases.problem(1)
    betas = torch.tensor([[1.0, -2.0, 0.5]]).double()
    assert ShapePrior(problem).cost(cases.candidate(problem, betas=betas)).item() == 5.25


def test_what_is_missing_is_named():
    problem = cases.problem(1)
    with pytest.raises(ValueError, match="points_3d: expected points"):
        Points3D(problem)
    with pytest.raises(ValueError, match="presented_pose: expected a presented pose"):
        PresentedPose(problem)
    shown = cases.presented()
    flat = cases.problem(1, presented=type(shown)(shown.pose.flatten(1)))
    with pytest.raises(ValueError, match=r"presented_pose: expected \(B, 23, 3\).*got \(1, 69\)"):
        PresentedPose(flat)
    with pytest.raises(ValueError, match="rho: expected positive"):
        Points3D(cases.problem(1, points_3d=torch.zeros(1, 5, 3)), rho=0.0)


def test_models_with_fingers_and_face(tmp_path):
    """SMPL-X: hands are 30 joints, jaw and eyes are another block, the mixture's hand joints count as 0."""
    template = torch.zeros(3, 3, dtype=torch.float64)
    body = SimpleNamespace(body=SimpleNamespace(joint_names=joints.SMPLX, hands=None), v_template=template)
    pose = torch.randn(2, 51, 3, generator=torch.Generator().manual_seed(5), dtype=torch.float64)
    shown = torch.zeros(2, 54, 3, dtype=torch.float64)
    problem = replace(cases.problem(2), body=body, presented=Presented(shown))
    smpl = cases.problem(2)
    given = SimpleNamespace(variables={"pose": pose})
    without_hands = cases.candidate(smpl, pose=torch.cat([pose[:, :21], torch.zeros_like(pose[:, :2])], dim=1))

    def cost(make):
        return make(problem).cost(given)

    torch.testing.assert_close(cost(HandPrior), pose[:, 21:].square().sum((1, 2)))
    torch.testing.assert_close(cost(PresentedPose), pose[:, :21].square().sum((1, 2)))
    assert JointLimits(problem).residuals(given).shape == (2, 21 * 3)
    for make in (JointLimits, PosePrior):
        torch.testing.assert_close(cost(make), make(smpl).cost(without_hands))
    cases.fake_mixture(tmp_path / "gmm.npz")
    mixture = partial(GaussianMixture, path=tmp_path / "gmm.npz")
    torch.testing.assert_close(cost(mixture), mixture(smpl).cost(without_hands))
    assert cost(Bending).isfinite().all()
