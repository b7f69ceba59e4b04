"""Where a fit starts, by the `search` of its preset:

body     the mean shape before the camera, as far away as its size in the image tells, in the presented pose, or in the
         one of the named poses that explains the points best, turned the way that does
mean     the same in the mean pose alone, or the presented one
camera   the camera around the presented body, which stays in its own frame with its ground
points   the mean shape on points in the world, in the named pose that comes nearest

SMPLify-X estimates the depth by similar triangles and tries a turn by 180°; SMPLify-XMC searches over yaws. Here both:
the most promising are fitted for a few iterations, and the lowest cost wins.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import torch
from torch import Tensor

from ipman_rs.body.poses import NAMES, pose_of
from ipman_rs.renamed import old_names

from .camera import NEAREST
from .camera import level_camera as level_camera
from .config import Stage, search_of, search_options
from .fit import run_stage, with_ground_under_body
from .objective import Objective
from .problem import Problem
from .rotations import matrix, nearest, vector
from .solvers import SolverOptions
from .variables import COMPONENTS, Variables, full_pose, pack, pose_blocks

# Far joints of the trunk, whose lengths change least with the pose, and then those of the legs and arms.
SPANS = (
    (("left_shoulder", "left_hip"), ("right_shoulder", "right_hip")),
    (
        ("left_hip", "left_knee"),
        ("right_hip", "right_knee"),
        ("left_knee", "left_ankle"),
        ("right_knee", "right_ankle"),
    ),
    (("left_shoulder", "left_elbow"), ("right_shoulder", "right_elbow")),
)
SEEN = 0.1  # confidence from which a point counts as seen
WEIGHTS = {"reprojection": 4.0, "pose_prior": 40.0, "joint_limits": 200.0, "shape_prior": 50.0}
DEEPEST = 100.0  # m
TRIED = 8  # placed poses that are fitted for a few iterations


def initial_state(problem: Problem, start: Mapping[str, Any]) -> tuple[Problem, dict[str, Tensor]]:
    """Problem and variables with which a fit begins, by a preset's `start`. If the camera moves around the body, the
    returned problem has a ground. ValueError for an unknown option."""
    how, given = search_of(start), search_options(start)
    if how == "points":
        return problem, start_at_points(problem)
    if how == "camera":
        if problem.ground is None:
            problem = with_ground_under_body(problem, neutral(problem))
        return problem, camera_around(problem, **given)
    return problem, (mean_before_camera if how == "mean" else before_camera)(problem, **given)


def neutral(problem: Problem) -> dict[str, Tensor]:
    """The mean body in the presented pose, or standing, arms down, at the world's origin; the camera as given."""
    bodies, model = problem.num_bodies, problem.body.body

    def zeros(*shape: int) -> Tensor:
        return torch.zeros(bodies, *shape, dtype=torch.float64)

    orient, pose = zeros(3), zeros(model.num_joints - 1, 3)
    if problem.presented is not None:
        pose = problem.presented.pose.double()
        orient = orient if problem.presented.orient is None else problem.presented.orient.double()
    else:
        standing = torch.as_tensor(pose_of(model, "standing"))[1:]
        pose = standing.expand(bodies, -1, -1).clone()
    return {
        **pose_blocks(torch.cat([orient[:, None], pose], dim=1), model),
        "betas": zeros(min(model.num_betas, COMPONENTS)),
        "expression": zeros(min(model.num_expressions, COMPONENTS)),
        "transl": zeros(3),
        "camera_orient": vector(problem.camera.rotation),
        "camera_transl": problem.camera.translation.clone(),
        "log_focal": zeros(2),
    }


def before_camera(problem: Problem, yaws: int = 4, iterations: int = 12) -> dict[str, Tensor]:
    """Variables with the body placed before the camera, which stays: in the presented pose, or in the one of the named
    poses of `ipman_rs.body.poses` that explains the points best. Needs points in an image."""
    poses = [neutral(problem)]
    if problem.presented is None:
        poses += [_posed(poses[0], problem, _named(problem, name)) for name in NAMES]
    return _best(problem, poses, yaws, ("orient", "transl"), iterations, moves_camera=False)


def mean_before_camera(problem: Problem, yaws: int = 2, iterations: int = 12) -> dict[str, Tensor]:
    """Variables with the mean body before the camera, in the mean of `terms.pose_prior` or the presented pose."""
    variables = neutral(problem)
    if problem.presented is None:
        from .terms.pose_prior import mean_pose

        variables = _posed(variables, problem, mean_pose(problem.body.body))
    return _best(problem, [variables], yaws, ("orient", "transl"), iterations, moves_camera=False)


def _posed(variables: Variables, problem: Problem, pose: Tensor) -> dict[str, Tensor]:
    """All bodies in one pose (J, 3), their pelvis turned as there."""
    own = pose_blocks(pose[None], problem.body.body)
    return {**variables, **{key: value.expand_as(variables[key]).clone() for key, value in own.items()}}


def _named(problem: Problem, name: str) -> Tensor:
    """(J, 3)."""
    return torch.as_tensor(pose_of(problem.body.body, name))


def camera_around(problem: Problem, yaws: int = 12, iterations: int = 12) -> dict[str, Tensor]:
    """Variables with the camera placed around the body, which stays in its own frame with its ground."""
    free = ("camera_orient", "camera_transl")
    return _best(problem, [neutral(problem)], yaws, free, iterations, moves_camera=True)


def start_at_points(problem: Problem) -> dict[str, Tensor]:
    """Variables with the mean body on its points in the world: in that named pose of `ipman_rs.body.poses` which comes
    nearest when it is moved and turned as a whole (Kabsch). Points that are not finite count as not seen."""
    if problem.points_3d is None:
        raise ValueError("points_3d: expected points (B, K, 3) in the world, got none")
    variables = neutral(problem)
    best, nearest_yet = _onto_points(problem, variables)
    for name in NAMES if problem.presented is None else ():
        posed = _posed(variables, problem, _named(problem, name))
        placed, away = _onto_points(problem, {**posed, "orient": variables["orient"]})
        nearer = away < nearest_yet
        best = {key: torch.where(nearer.reshape(-1, *[1] * (a.ndim - 1)), placed[key], a) for key, a in best.items()}
        nearest_yet = torch.where(nearer, away, nearest_yet)
    return best


def _onto_points(problem: Problem, variables: Variables) -> tuple[dict[str, Tensor], Tensor]:
    """The body moved and turned as a whole onto its points, and the mean squared distance (B,) that is left."""
    assert problem.points_3d is not None
    pose = full_pose(variables, problem.body.body)
    body = problem.landmarks(pose, variables["betas"], variables["transl"])
    points = problem.points_3d.nan_to_num()
    weight = problem.points_3d.isfinite().all(dim=-1).double()
    if problem.confidence_3d is not None:
        weight = weight * problem.confidence_3d
    weight = (weight / weight.sum(dim=1, keepdim=True).clamp(min=1e-12))[..., None]
    middle, target = (body * weight).sum(dim=1), (points * weight).sum(dim=1)
    body, points = body - middle[:, None], points - target[:, None]
    turn = nearest((weight[..., None] * points[..., :, None] * body[..., None, :]).sum(dim=1))
    away = points - (turn[:, None] * body[:, :, None]).sum(dim=3)
    # The root joint stays where it is when the body turns.
    root = problem.body(pose[:1].to(problem.body.dtype)).joints[:, 0].to(middle)
    turned = (turn * (middle - root)[:, None]).sum(dim=2)
    placed = {**variables, "orient": vector(turn @ matrix(variables["orient"])), "transl": target - root - turned}
    return placed, (weight * away.square()).sum(dim=(1, 2))


def _best(
    problem: Problem,
    poses: Sequence[Variables],
    yaws: int,
    free: tuple[str, ...],
    iterations: int,
    moves_camera: bool,
) -> dict[str, Tensor]:
    """Of all poses and yaws, each placed, the `TRIED` that explain the points best are fitted; the lowest cost wins."""
    bodies, count = problem.num_bodies, len(poses) * yaws
    many = problem.rows(torch.arange(bodies).repeat_interleave(count))
    starts = {
        name: torch.stack([pose[name] for pose in poses], dim=1).repeat_interleave(yaws, dim=1).flatten(0, 1)
        for name in poses[0]
    }
    turns = torch.arange(yaws, dtype=torch.float64).repeat(bodies * len(poses)) * (2 * math.pi / yaws)
    # Named poses lie or stand on their heads by themselves: only the first one is rolled as the image is.
    rolls = (torch.arange(count) < yaws).repeat(bodies)
    starts = _placed(many, starts, turns, rolls, moves_camera)
    with torch.no_grad():
        placed = Objective(many, starts, free, WEIGHTS)
        costs = torch.stack(list(placed.costs(placed.candidate(pack(starts, free))).values())).sum(dim=0)
    tried = min(TRIED, count)
    order = costs.nan_to_num(nan=torch.inf).reshape(bodies, count).argsort(dim=1, stable=True)[:, :tried]
    rows = (order + count * torch.arange(bodies)[:, None]).flatten()
    stage = Stage("start", free, WEIGHTS, "levenberg", SolverOptions(iterations=iterations, gradient=1.0, decrease=1.0))
    fitted, report = run_stage(many.rows(rows), {name: value[rows] for name, value in starts.items()}, stage, {})
    ends = np.nan_to_num(sum(report.terms.values()), nan=np.inf).reshape(bodies, tried)
    winners = torch.from_numpy(ends.argmin(axis=1)) + tried * torch.arange(bodies)
    return {name: value[winners] for name, value in fitted.items()}


def _placed(
    problem: Problem, variables: Variables, yaws: Tensor, rolls: Tensor, moves_camera: bool
) -> dict[str, Tensor]:
    """The body, or the camera, turned by the yaws and moved so that the trunk is seen where it was in the image."""
    zero = torch.zeros_like(yaws)
    turn = matrix(torch.stack([zero, yaws, zero], dim=-1))
    rotation = problem.camera.rotation
    if moves_camera:
        rotation = rotation @ turn
        variables = {**variables, "camera_orient": vector(rotation)}
    else:
        roll = torch.where(rolls, _roll(problem), 0.0)
        tilt = matrix(torch.stack([zero, zero, roll], dim=-1))  # about the camera's line of sight
        upright = rotation.transpose(1, 2) @ tilt @ rotation
        variables = {**variables, "orient": vector(upright @ turn @ matrix(variables["orient"]))}
    pose = full_pose(variables, problem.body.body)
    points = problem.landmarks(pose, variables["betas"], variables["transl"])
    seen = (rotation[:, None] * points[:, :, None]).sum(dim=-1)  # turned into the camera's axes
    depth = _depth(problem, points)
    weight = _seen(problem).double()
    weight = weight / weight.sum(dim=1, keepdim=True).clamp(min=1)
    assert problem.points is not None
    ray = (problem.points - problem.camera.center[:, None]) / problem.camera.focal[:, None]
    middle = ((ray * weight[..., None]).sum(dim=1) * depth[:, None], depth[:, None])
    shift = torch.cat(middle, dim=1) - (seen * weight[..., None]).sum(dim=1)
    if moves_camera:
        return {**variables, "camera_transl": shift}
    world = ((shift - problem.camera.translation)[:, :, None] * rotation).sum(dim=1)
    return {**variables, "transl": variables["transl"] + world}


def _seen(problem: Problem) -> Tensor:
    assert problem.confidence is not None
    return problem.confidence > SEEN


def _ends(problem: Problem, name: str) -> int | None:
    names = problem.landmarks.names
    return names.index(name) if name in names else None


def _depth(problem: Problem, points: Tensor) -> Tensor:
    """(B,): f · length / length in the image, by the first group of spans of which one is seen; 5 m if none is."""
    assert problem.points is not None
    seen, depth = _seen(problem), torch.full((len(points),), torch.nan, dtype=torch.float64)
    for spans in SPANS:
        ends = [(_ends(problem, a), _ends(problem, b)) for a, b in spans]
        pairs = [(a, b) for a, b in ends if a is not None and b is not None]
        if not pairs:
            continue
        first, second = map(list, zip(*pairs, strict=True))
        both = (seen[:, first] & seen[:, second]).double()
        real = ((points[:, first] - points[:, second]).norm(dim=-1) * both).sum(dim=1)
        image = (
            ((problem.points[:, first] - problem.points[:, second]) / problem.camera.focal[:, None]).norm(dim=-1) * both
        ).sum(dim=1)
        depth = torch.where(depth.isnan() & (image > 0), real / image.clamp(min=1e-12), depth)
    return depth.nan_to_num(5.0).clamp(min=10 * NEAREST, max=DEEPEST)


def _roll(problem: Problem) -> Tensor:
    """(B,) radians: how far the trunk in the image is turned from upright, in steps of 90°."""
    assert problem.points is not None
    ends = [_ends(problem, f"{side}_{joint}") for joint in ("hip", "shoulder") for side in ("left", "right")]
    bodies = len(problem.points)
    if any(end is None for end in ends):
        return torch.zeros(bodies, dtype=torch.float64)
    points = problem.points[:, ends]
    up = points[:, 2:].mean(dim=1) - points[:, :2].mean(dim=1)
    roll = torch.atan2(up[:, 0], -up[:, 1])
    known = _seen(problem)[:, ends].all(dim=1)
    return torch.where(known, (roll / (math.pi / 2)).round() * (math.pi / 2), 0.0)


__getattr__ = old_names(__name__, {"begin": "initial_state", "at_points": "start_at_points"})
