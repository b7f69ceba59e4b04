"""Joint limits and the pose prior: the angles, the ranges, and the named poses against them."""

from __future__ import annotations

import math

import pytest
import torch
from scipy.spatial.transform import Rotation

from ipman_rs.body import joints, poses
from ipman_rs.fitting.terms.joint_limits import RANGES, JointLimits, range_of, swing_twist
from ipman_rs.fitting.terms.pose_prior import PosePrior, mean_of
from tests.helpers import fit_terms_cases as cases

NAMES = joints.SMPL[1:]


def pose_with(joint: str, degrees) -> torch.Tensor:
    pose = torch.zeros(1, 23, 3, dtype=torch.float64)
    pose[0, NAMES.index(joint)] = torch.tensor(degrees, dtype=torch.float64).deg2rad()
    return pose


def limits(pose: torch.Tensor, margin: float = 10.0) -> torch.Tensor:
    problem = cases.problem(len(pose))
    return JointLimits(problem, margin).residuals(cases.candidate(problem, pose=pose)).reshape(len(pose), 23, 3)


@pytest.mark.parametrize("bone", [0, 1, 2])
def test_angles_put_together_give_the_rotation_back(bone):
    generator = torch.Generator().manual_seed(bone)
    pose = torch.randn(200, 1, 3, generator=generator, dtype=torch.float64)
    angles = swing_twist(pose, torch.tensor([bone]))[:, 0]
    twist, swing = torch.zeros_like(angles), angles.clone()
    twist[:, bone], swing[:, bone] = angles[:, bone], 0
    together = Rotation.from_rotvec(swing.numpy()) * Rotation.from_rotvec(twist.numpy())
    error = (together * Rotation.from_rotvec(pose[:, 0].numpy()).inv()).magnitude()
    assert error.max() < 1e-14


def test_a_turn_about_one_axis_is_its_angle():
    for bone in range(3):
        for axis in range(3):
            pose = torch.zeros(1, 1, 3, dtype=torch.float64)
            for angle in (-2.5, -1e-9, 0.0, 1e-4, 1.0, 3.0):
                pose[0, 0, axis] = angle
                torch.testing.assert_close(swing_twist(pose, torch.tensor([bone])), pose, rtol=1e-14, atol=1e-15)


def test_rotations_by_a_full_turn_more_are_the_same():
    generator = torch.Generator().manual_seed(0)
    pose = torch.randn(50, 3, 3, generator=generator, dtype=torch.float64)
    angle = torch.linalg.vector_norm(pose, dim=-1, keepdim=True)
    more = pose * (1 + 2 * math.pi / angle)
    bones = torch.tensor([0, 1, 2])
    torch.testing.assert_close(swing_twist(more, bones), swing_twist(pose, bones), rtol=0, atol=1e-13)


def test_a_bone_that_points_back_has_finite_gradients():
    pose = torch.tensor([[[0.0, 0.0, math.pi]]], dtype=torch.float64, requires_grad=True)
    angles = swing_twist(pose, torch.tensor([0]))
    (gradient,) = torch.autograd.grad(angles.sum(), pose)
    assert angles.isfinite().all()
    assert gradient.isfinite().all()


def test_gradients_near_zero_and_across_the_series():
    for scale in (1e-9, 1e-4, 2e-3, 1.0):
        pose = scale * torch.randn(2, 3, 3, generator=torch.Generator().manual_seed(1), dtype=torch.float64)
        bones = torch.tensor([0, 1, 2])
        assert torch.autograd.gradcheck(
            lambda pose, bones=bones: swing_twist(pose, bones), (pose.requires_grad_(),), check_forward_ad=True
        )


def test_beyond_a_range_by_hand():
    excess = math.radians(20)
    expected = excess**2 / (excess + math.radians(5))
    overextended = limits(pose_with("left_knee", [-30, 0, 0]))  # 0, and 10 of margin
    assert overextended[0, NAMES.index("left_knee"), 0].item() == pytest.approx(expected, rel=1e-12)
    assert overextended.count_nonzero() == 1
    assert limits(pose_with("left_knee", [-9, 0, 0])).count_nonzero() == 0
    strict = limits(pose_with("left_knee", [-20, 0, 0]), margin=0.0)
    assert strict[0, NAMES.index("left_knee"), 0].item() == pytest.approx(expected, rel=1e-12)


def test_sides_mirror():
    values = cases.variables(4, scale=1.5)["pose"]
    mirrored = torch.empty_like(values)
    for index, name in enumerate(NAMES):
        other = {"left": "right_", "right": "left_"}.get(name.partition("_")[0], "") + name.partition("_")[2]
        mirrored[:, NAMES.index(other or name)] = values[:, index] * torch.tensor([1, -1, -1])
    torch.testing.assert_close(limits(values).square().sum((1, 2)), limits(mirrored).square().sum((1, 2)))
    for joint in RANGES:
        if joint in NAMES:
            (_, *sides) = range_of(joint)
            assert all(low == -high for low, high in sides)


def test_named_poses_are_possible():
    """All but two yoga poses, which turn a hip out further than the tables know, by 20° and 10°."""
    pose = torch.stack([torch.from_numpy(poses.pose(name))[1:] for name in poses.NAMES])
    worst = limits(pose).amax(dim=(1, 2)).rad2deg()
    for name, beyond in zip(poses.NAMES, worst.tolist(), strict=True):
        assert beyond < {"tree": 20, "warrior": 10}.get(name, 1.2), name


def test_impossible_poses_are_not():
    for joint, degrees in (
        ("right_elbow", [0, -60, 0]),
        ("left_hip", [80, 0, 0]),
        ("head", [0, 120, 0]),
        ("right_knee", [0, 0, 40]),
        ("left_ankle", [-60, 0, 0]),
    ):
        assert limits(pose_with(joint, degrees)).amax().rad2deg() > 20, joint


def test_prior_is_zero_at_its_mean_and_one_a_deviation_off():
    mean = torch.tensor([mean_of(name) for name in NAMES], dtype=torch.float64).deg2rad()[None]
    problem = cases.problem(1)
    term = PosePrior(problem)
    assert term.cost(cases.candidate(problem, pose=mean)).item() == 0
    off = mean.clone()
    off[0, NAMES.index("left_elbow"), 1] += math.radians(150 / 4)
    off[0, NAMES.index("right_knee"), 2] += math.radians(5)  # its range of ±5 would be 2.5 wide
    assert term.cost(cases.candidate(problem, pose=off)).item() == pytest.approx(2, rel=1e-12)
    assert PosePrior(problem, width=2).cost(cases.candidate(problem, pose=off)).item() == pytest.approx(0.5, rel=1e-12)


def test_means_lie_within_the_ranges():
    for name in NAMES:
        for mean, (low, high) in zip(mean_of(name), range_of(name), strict=True):
            assert low <= mean <= high, name


def test_bad_options_are_refused():
    with pytest.raises(ValueError, match="margin: expected zero or more"):
        JointLimits(cases.problem(1), margin=-1.0)
    with pytest.raises(ValueError, match="width: expected positive"):
        PosePrior(cases.problem(1), width=0.0)
