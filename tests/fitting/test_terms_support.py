"""What holds a body up: flat soles, a seat, and the centre of mass of its segments over its feet."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
import torch

import ipman_rs as ip
import ipman_rs.torch as ipt
from ipman_rs.body import joints, poses
from ipman_rs.fitting.candidate import Candidate
from ipman_rs.fitting.landmarks import Landmarks
from ipman_rs.fitting.problem import Problem
from ipman_rs.fitting.rotations import matrix, vector
from ipman_rs.fitting.support_points import OTHERS
from ipman_rs.fitting.terms.flat_soles import FlatSoles
from ipman_rs.fitting.terms.seat import Seat
from ipman_rs.fitting.terms.segment_balance import SegmentBalance
from tests.helpers import fit_terms_cases as cases

SOLE = [f"{side}_{point}" for side in ("left", "right") for point in ("heel", "big_toe", "small_toe")]


def double(*numbers) -> torch.Tensor:
    return torch.tensor(numbers, dtype=torch.float64)


def on_its_ground(*names: str, up: float = 0.0) -> tuple[Problem, dict[str, torch.Tensor]]:
    """Bodies in named poses, their lowest vertices `up` metres above the ground y = 0."""
    problem = cases.problem(len(names))
    body = problem.body.body
    values = cases.zeros(len(names))
    full = torch.stack([torch.as_tensor(poses.pose_of(body, name)) for name in names]).double()
    values |= {"orient": full[:, 0], "pose": full[:, 1:]}
    values["transl"][:, 1] = up - Candidate(problem, values).vertices[..., 1].amin(dim=1)
    return problem, values


def points(problem: Problem, values, *names: str) -> np.ndarray:
    """(B, K, 3) by the numpy body: joints, or points of the skin."""
    body = problem.body.body
    pose = torch.cat([values["orient"][:, None], values["pose"]], dim=1).numpy()
    posed = body(pose, values["betas"].numpy(), values["transl"].numpy())
    skin = ip.body.landmarks.skin_points(body)
    places = [
        posed.joints[:, body.joint_names.index(n)] if n in body.joint_names else posed.vertices[:, skin[n]]
        for n in names
    ]
    return np.stack(places, axis=1)


def one(*flags: bool) -> torch.Tensor:
    return torch.tensor(flags)


def test_flat_soles_cost_nothing_on_the_ground():
    problem, values = on_its_ground("t_pose")
    assert FlatSoles(problem).cost(Candidate(problem, values)).item() < 1e-24


@pytest.mark.parametrize("rho", [0.05, 0.1])
def test_soles_that_are_raised(rho):
    problem, values = on_its_ground("t_pose", up=0.03)
    expected = 6 * rho**2 * 0.03**2 / (0.03**2 + rho**2)
    assert FlatSoles(problem, rho=rho).cost(Candidate(problem, values)).item() == pytest.approx(expected, rel=1e-12)
    sunk = {**values, "transl": values["transl"] - double(0, 0.06, 0)}
    assert FlatSoles(problem, rho=rho).cost(Candidate(problem, sunk)).item() == pytest.approx(expected, rel=1e-12)


def test_soles_against_the_formula():
    names = ("walking", "squat", "one_leg")
    problem, values = on_its_ground(*names, up=0.01)
    flat = points(*on_its_ground("t_pose"), *SOLE)[..., 1]
    squares = np.square(points(problem, values, *SOLE)[..., 1] - flat)
    expected = 0.05**2 * squares / (squares + 0.05**2)
    body = Candidate(problem, values)
    np.testing.assert_allclose(FlatSoles(problem).cost(body), expected.sum(axis=1), rtol=1e-12)
    down = torch.tensor([[True, False], [True, True], [False, False]])
    counted = np.repeat(down.numpy(), 3, axis=1)
    some = FlatSoles(replace(problem, feet_down=down)).cost(body)
    np.testing.assert_allclose(some, (counted * expected).sum(axis=1), rtol=1e-12)
    assert some[2] == 0


def test_soles_and_seats_and_balance_go_with_a_ground_that_is_tilted():
    problem, values = on_its_ground("lunge", "squat", "lean_past_toes", up=0.02)
    problem = replace(problem, seated=one(True, True, False))
    turn = matrix(double(0.4, 0.2, -0.3)[None])[0]
    root = Landmarks(problem.body, ["pelvis"])(torch.zeros(1, 24, 3).double())[0, 0]
    place = (root + values["transl"]) @ turn.T - root + 2.0 * turn[:, 1]
    turned = {**values, "orient": vector(turn @ matrix(values["orient"])), "transl": place}
    ground = ipt.Ground(turn[:, 1].expand(3, 3), torch.full((3,), 2.0, dtype=torch.float64))
    for make in (FlatSoles, Seat, SegmentBalance):
        level = make(problem).cost(Candidate(problem, values))
        tilted = make(replace(problem, ground=ground)).cost(Candidate(problem, turned))
        torch.testing.assert_close(tilted, level, rtol=0, atol=1e-14)
        assert level.max() > 1e-4


def segments_by_hand(problem: Problem, values) -> np.ndarray:
    """De Leva's centre of mass (B, 3), the mean of women and men, from joints and toes."""
    both = ("shoulder", "elbow", "wrist", "hip", "knee", "ankle", "big_toe")
    names = [*(f"{side}_{name}" for side in ("left", "right") for name in both), "neck", "head"]
    at = dict(zip(names, np.moveaxis(points(problem, values, *names), 1, 0), strict=True))
    hips = (at["left_hip"] + at["right_hip"]) / 2
    moments = [0.430 * (0.45 * hips + 0.55 * at["neck"]), 0.068 * at["head"]]
    masses = [0.430, 0.068]
    table = (
        ("shoulder", "elbow", 0.0263, 0.58), ("elbow", "wrist", 0.0150, 0.46), ("wrist", "wrist", 0.0059, 0),
        ("hip", "knee", 0.1447, 0.39), ("knee", "ankle", 0.0457, 0.44), ("ankle", "big_toe", 0.0133, 0.4),
    )  # fmt: skip
    for side in ("left", "right"):
        for a, b, mass, share in table:
            moments.append(mass * ((1 - share) * at[f"{side}_{a}"] + share * at[f"{side}_{b}"]))
            masses.append(mass)
    return sum(moments) / sum(masses)


def away_from(centre: np.ndarray, start: np.ndarray, end: np.ndarray) -> float:
    """Horizontal distance of a point from a line between two, by looking at a million places of it."""
    line = start + np.linspace(0, 1, 1_000_001)[:, None] * (end - start)
    return float(np.hypot(*(centre - line)[:, [0, 2]].T).min())


def balance(problem: Problem, values, **options) -> np.ndarray:
    return SegmentBalance(problem, **options).cost(Candidate(problem, values)).numpy()


@pytest.mark.parametrize(
    ("down", "seated"),
    [((True, True), False), ((True, False), False), ((False, True), False), ((False, False), False),
     ((True, True), True), ((False, True), True)],
)  # fmt: skip
def test_balance_against_the_formula(down, seated):
    problem, values = on_its_ground("lean_past_toes")
    values["transl"] += double(0.2, 0, 0.1)
    values["pose"][0, joints.SMPL.index("left_knee") - 1, 0] = 1.2
    problem = replace(problem, feet_down=one(*down)[None], seated=one(seated))
    heel_toe = points(problem, values, "left_heel", "left_big_toe", "right_heel", "right_big_toe")[0]
    left, right = heel_toe[:2].mean(axis=0), heel_toe[2:].mean(axis=0)
    start, end = {(True, False): (left, left), (False, True): (right, right)}.get(down, (left, right))
    centre = segments_by_hand(problem, values)[0]
    distance = away_from(centre, start, end)
    if seated:
        hips = points(problem, values, "left_hip", "right_hip")[0].mean(axis=0)
        distance = min(distance, away_from(centre, hips, start), away_from(centre, hips, end))
    radius = 0.01
    assert distance > radius
    assert balance(problem, values, radius=radius)[0] == pytest.approx((distance - radius) ** 2, rel=1e-6)


def test_balance_is_free_within_the_radius():
    problem, values = on_its_ground("standing", "lean_past_toes")
    costs = balance(problem, values)
    assert costs[0] == 0
    assert costs[1] > 0.005
    distance = 0.1 + math.sqrt(costs[1])
    assert balance(problem, values, radius=distance + 1e-6).max() == 0
    # Squared metres beyond the radius.
    assert balance(problem, values, radius=distance - 0.02)[1] == pytest.approx(0.02**2, rel=1e-9)
    assert balance(problem, values, radius=distance - 0.04)[1] == pytest.approx(0.04**2, rel=1e-9)


def test_what_moves_need_not_balance():
    problem, values = on_its_ground("lean_past_toes", "lean_past_toes")
    costs = balance(replace(problem, static=one(True, False)), values)
    assert costs[0] > 0
    assert costs[1] == 0


def test_segments_know_the_centre_of_mass():
    """Within 2.5 cm of that of the whole mesh; 6 where the trunk is bent back, whose segment is straight."""
    problem, values = on_its_ground(*poses.NAMES)
    body = Candidate(problem, values)
    term = SegmentBalance(problem)
    found = (term.mass[:, None] * body.points_of(term.landmarks)).sum(dim=1).numpy()
    np.testing.assert_allclose(found, segments_by_hand(problem, values), rtol=0, atol=1e-12)
    exact = ip.center_of_mass(body.vertices.numpy(), problem.body.body.template, method="exact")
    for name, error in zip(poses.NAMES, np.linalg.norm(found - exact, axis=1), strict=True):
        assert error < (0.06 if name == "cobra" else 0.025), name


def test_named_poses_that_stand_are_in_balance():
    names = ("standing", "t_pose", "a_pose", "walking", "one_leg", "tree", "warrior", "lunge", "chair", "squat")
    problem, values = on_its_ground(*names)
    down = torch.tensor([[True, name not in ("one_leg", "tree")] for name in names])
    assert balance(replace(problem, feet_down=down), values).max() < 0.02**2


def test_seats():
    problem, values = on_its_ground("t_pose", "squat", "t_pose")
    problem = replace(problem, seated=one(True, True, False))
    joints_of_legs = [f"{side}_{joint}" for joint in ("hip", "knee", "ankle") for side in ("left", "right")]
    hips, knees, ankles = np.split(points(problem, values, *joints_of_legs)[..., 1], 3, axis=1)
    steep, raised = np.maximum(np.abs(hips - knees) - 0.12, 0), np.maximum(0.15 - (knees - ankles), 0)
    costs = Seat(problem).cost(Candidate(problem, values)).numpy()
    expected = np.square(steep).sum(axis=1) + np.square(raised).sum(axis=1)
    np.testing.assert_allclose(costs[:2], expected[:2], rtol=1e-12)
    assert costs[0] > 0.1  # legs that hang
    assert costs[2] == 0  # nobody sits
    assert Seat(problem, slack=0.6).cost(Candidate(problem, values)).max() == 0


def test_level_thighs_cost_nothing_whichever_way_they_are_off():
    problem, values = on_its_ground("chair", "chair")
    problem = replace(problem, seated=one(True, True))
    pose = values["pose"]
    for joint in ("left_hip", "right_hip"):
        pose[0, joints.SMPL.index(joint) - 1] = double(-math.pi / 2, 0, 0)
        pose[1, joints.SMPL.index(joint) - 1] = double(-math.pi / 2 - 1.0, 0, 0)  # knees high
    values["orient"][:] = 0
    costs = Seat(problem).cost(Candidate(problem, values))
    assert costs[0] == 0
    thigh = np.diff(points(problem, values, "left_hip", "left_knee")[1, :, 1])[0]
    assert thigh > 0.2
    assert costs[1].item() == pytest.approx(2 * (thigh - 0.12) ** 2, rel=1e-9)


def test_what_is_missing_is_named():
    problem = replace(cases.problem(1), ground=None)
    for make, what in ((FlatSoles, "flat soles"), (Seat, "a seat"), (SegmentBalance, "the balance of segments")):
        with pytest.raises(ValueError, match=f"ground: expected one for {what}; give it, or let a stage find it"):
            make(problem)
    for make, option in ((FlatSoles, "rho"), (SegmentBalance, "radius")):
        with pytest.raises(ValueError, match=f"{option}: expected positive"):
            make(cases.problem(1), **{option: 0.0})
    with pytest.raises(ValueError, match="slack: expected zero or more"):
        Seat(cases.problem(1), slack=-0.1)


def test_thighs_that_are_level_without_a_seat():
    """Who lies has level thighs, too, but no feet below the knees."""
    problem, values = on_its_ground("lying")
    heights = points(problem, values, "left_knee", "right_knee", "left_ankle", "right_ankle")[0, :, 1]
    raised = np.maximum(0.15 - (heights[:2] - heights[2:]), 0)
    cost = Seat(replace(problem, seated=one(True)), slack=1.0).cost(Candidate(problem, values)).item()
    assert cost == pytest.approx(np.square(raised).sum(), rel=1e-12)
    assert cost > 0.02


def test_what_else_is_on_the_floor():
    """Hands and knees carry who crawls: the soles are left alone, and the hull reaches from the hands to the knees."""
    problem, values = on_its_ground("all_fours")
    down = torch.tensor([[name in ("left_index", "right_index", "left_knee", "right_knee") for name in OTHERS]])
    crawling = replace(problem, feet_down=torch.zeros(1, 2, dtype=torch.bool), others_down=down, on_floor=one(True))
    assert balance(crawling, values, radius=0.01)[0] == 0  # inside the hull, though far from any line of it
    hands = down & torch.tensor([["index" in name for name in OTHERS]])
    assert balance(replace(crawling, others_down=hands), values)[0] > 0.01
    heights = points(problem, values, *OTHERS)[0, :, 1] - np.array(list(OTHERS.values()))
    squares = np.square(heights[down[0].numpy()])
    expected = (0.05**2 * squares / (squares + 0.05**2)).sum()
    assert FlatSoles(crawling).cost(Candidate(problem, values)).item() == pytest.approx(expected, rel=1e-9)
    with_feet = replace(crawling, feet_down=torch.ones(1, 2, dtype=torch.bool))
    assert FlatSoles(with_feet).cost(Candidate(problem, values)).item() == pytest.approx(expected, rel=1e-9)
