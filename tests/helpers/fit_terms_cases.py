"""Problems and candidates that the tests of single terms share, small and without files."""

from __future__ import annotations

import functools
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import torch
from torch import Tensor

import ipman_rs.torch as ipt
from ipman_rs.body import BodyModel as NumpyBody
from ipman_rs.body import joints, load_body
from ipman_rs.body.hands import Hands
from ipman_rs.fitting.camera import Camera
from ipman_rs.fitting.candidate import Candidate
from ipman_rs.fitting.problem import Presented, Problem
from ipman_rs.fitting.support_points import OTHERS
from ipman_rs.fitting.terms import Term

HELD = (
    "feet_down", "others_down", "on_floor", "static", "seated", "relative_points", "relative_confidence",
)  # fmt: skip
PER_BODY = ("points_3d", "confidence_3d", "height", "mass", *HELD)


@functools.cache
def body_model(dtype: torch.dtype = torch.float64) -> ipt.BodyModel:
    return ipt.BodyModel("anny-lite", dtype=dtype)


@dataclass(frozen=True)
class JointLandmarks:
    """Five joints as landmarks."""

    body: ipt.BodyModel
    names: tuple[str, ...] = ("pelvis", "head", "left_wrist", "right_ankle", "left_foot")

    def __call__(self, pose: Tensor, betas: Tensor, transl: Tensor, expression: Tensor | None = None) -> Tensor:
        return self.body(pose, betas, transl).joints[:, [joints.SMPL.index(name) for name in self.names]]


def problem(batch: int = 2, dtype: torch.dtype = torch.float64, **known) -> Problem:
    body = body_model(dtype)
    eye, zeros, ones = torch.eye(3, dtype=dtype), torch.zeros(batch, 3, dtype=dtype), torch.ones(batch, 2, dtype=dtype)
    camera = Camera(1000 * ones, 500 * ones, eye.expand(batch, 3, 3), zeros)
    return Problem(body, JointLandmarks(body), camera, ipt.Ground.y_up(), **known)


def variables(
    batch: int = 2, dtype: torch.dtype = torch.float64, seed: int = 3, scale: float = 0.5
) -> dict[str, Tensor]:
    generator = torch.Generator().manual_seed(seed)
    sizes = {"orient": (3,), "pose": (23, 3), "betas": (body_model().body.num_betas,), "transl": (3,)}
    sizes |= {"camera_orient": (3,), "camera_transl": (3,), "log_focal": (2,), "face": (0, 3), "expression": (0,)}
    return {
        name: (scale * torch.randn(batch, *size, generator=generator, dtype=torch.float64)).to(dtype)
        for name, size in sizes.items()
    }


def zeros(batch: int = 2, dtype: torch.dtype = torch.float64) -> dict[str, Tensor]:
    return {name: torch.zeros_like(value) for name, value in variables(batch, dtype).items()}


def candidate(problem: Problem, **given: Tensor) -> Candidate:
    batch = next(iter(given.values())).shape[0]
    return Candidate(problem, {**zeros(batch, problem.body.dtype), **given})


def cost_and_gradient(
    term: Term, values: dict[str, Tensor], rows: slice = slice(None)
) -> tuple[Tensor, dict[str, Tensor]]:
    """The term's cost (B,) and its gradient in each block; `rows` of the values are looked at."""
    values = {name: value[rows].clone().requires_grad_() for name, value in values.items()}
    cost = term.cost(Candidate(term.problem, values))
    gradients = torch.autograd.grad(cost.sum(), list(values.values()), allow_unused=True, materialize_grads=True)
    return cost.detach(), dict(zip(values, gradients, strict=True))


def row_of(problem: Problem, row: int) -> Problem:
    """The problem of one body."""
    part = {name: getattr(problem, name)[row : row + 1] for name in PER_BODY if getattr(problem, name) is not None}
    presented = problem.presented
    if presented is not None and len(presented.pose) > 1:
        orient = None if presented.orient is None else presented.orient[row : row + 1]
        part["presented"] = replace(presented, pose=presented.pose[row : row + 1], orient=orient)
    return replace(problem, **part)


def assert_rows_are_alone(make, problem: Problem, values: dict[str, Tensor]) -> None:
    """Cost and gradient of a body have the same bits alone, in the batch, and beside other numbers."""
    cost, gradient = cost_and_gradient(make(problem), values)
    assert cost.shape == (len(values["pose"]),)
    assert cost.isfinite().all()
    for row in range(len(cost)):
        alone, own = cost_and_gradient(make(row_of(problem, row)), values, slice(row, row + 1))
        assert torch.equal(alone[0], cost[row])
        for name in gradient:
            assert torch.equal(own[name][0], gradient[name][row]), name


def fake_mixture(path: Path, seed: int = 0, components: int = 4) -> dict[str, np.ndarray]:
    """A mixture in the layout of SMPLify's file, as .npz."""
    rng = np.random.default_rng(seed)
    roots = np.eye(69) + 0.05 * rng.normal(size=(components, 69, 69))
    arrays = {
        "means": 0.3 * rng.normal(size=(components, 69)),
        "covars": 0.1 * roots @ roots.transpose(0, 2, 1),
        "weights": rng.dirichlet(np.ones(components)),
    }
    np.savez(path, **arrays)
    return arrays


def fake_vposer(neurons: int = 16, latent: int = 5) -> tuple[torch.nn.Sequential, torch.nn.Linear]:
    """Random layers of VPoser's encoder and its mean, in evaluation mode, float64."""
    torch.manual_seed(4)
    nn = torch.nn
    body = nn.Sequential(
        nn.Flatten(), nn.BatchNorm1d(63), nn.Linear(63, neurons), nn.LeakyReLU(), nn.BatchNorm1d(neurons),
        nn.Dropout(0.1), nn.Linear(neurons, neurons), nn.Linear(neurons, neurons),
    )  # fmt: skip
    body(torch.randn(50, 63))  # running figures other than 0 and 1
    with torch.no_grad():
        for norm in (body[1], body[4]):
            norm.weight.uniform_(0.5, 2.0)
            norm.bias.uniform_(-1.0, 1.0)
    return body.double().eval(), nn.Linear(neurons, latent).double()


def save_vposer(path: Path, prefix: str = "vp_model.") -> tuple[torch.nn.Sequential, torch.nn.Linear]:
    body, mean = fake_vposer()
    state = {f"{prefix}encoder_net.{name}": value for name, value in body.state_dict().items()}
    state |= {f"{prefix}encoder_net.8.mu.{name}": value for name, value in mean.state_dict().items()}
    torch.save({"state_dict": state}, path)
    return body, mean


@functools.cache
def smplx_body() -> ipt.BodyModel:
    """The light embedded body with SMPL-X's joints, float64: fingers and a jaw that move skin, four expressions, a mean
    hand, and components of the hands that are neither orthogonal nor of length 1."""
    body, rng = load_body("anny-lite"), np.random.default_rng(8)
    rest = body()
    vertices, head = rest.vertices, rest.joints[joints.SMPL.index("head")]
    places = {name: rest.joints[row] for row, name in enumerate(joints.SMPL)}
    weights = np.zeros((body.num_vertices, 55))
    for row, name in enumerate(body.joint_names):
        weights[:, joints.SMPLX.index(name.replace("hand", "index1"))] += body.weights[:, row]
    in_front = vertices - head
    places |= {"jaw": head + [0, 0.0, 0.05]}
    places |= {f"{side}_eye_smplhf": head + [sign * 0.03, 0.08, 0.1] for side, sign in (("left", 1), ("right", -1))}
    of_head = body.weights[:, joints.SMPL.index("head")] > 0.5
    weights[of_head & (in_front[:, 1] < 0.03) & (in_front[:, 2] > 0.05)] = np.eye(55)[joints.SMPLX.index("jaw")]
    fingers = {"index": 0.03, "middle": 0.01, "pinky": -0.03, "ring": -0.01, "thumb": 0.05}
    for side, sign in (("left", 1), ("right", -1)):
        hand = places[f"{side}_hand"]
        for finger, z in fingers.items():
            places |= {f"{side}_{finger}{i}": hand + [sign * 0.02 * i, 0, z] for i in (1, 2, 3)}
            tip = sign * (vertices[:, 0] - hand[0]) > 0.05
            near = tip & (abs(vertices[:, 2] - hand[2] - z) < 0.01)
            weights[near] = np.eye(55)[joints.SMPLX.index(f"{side}_{finger}3")]
    joint_places = np.array([places[name] for name in joints.SMPLX])
    ones = np.eye(body.num_betas)
    moved = [body(betas=one) for one in ones]
    shapes = np.stack([each.vertices - vertices for each in moved], axis=-1)
    joint_shapes = np.zeros((55, 3, body.num_betas))
    joint_shapes[:22] = np.stack([each.joints - rest.joints for each in moved], axis=-1)[:22]
    joint_shapes[22:25], joint_shapes[25:40], joint_shapes[40:] = joint_shapes[15], joint_shapes[20], joint_shapes[21]
    expressions = 3e-3 * rng.normal(size=(body.num_vertices, 3, 4)) * of_head[:, None, None]
    joint_expressions = 1e-3 * rng.normal(size=(55, 3, 4)) * np.isin(np.arange(55), [22, 23, 24])[:, None, None]
    mixed = rng.normal(size=(2, 45, 45)) * 0.2
    hands = Hands(0.1 * rng.normal(size=(30, 3)), *mixed)
    parents = np.array([-1, *joints.SMPL_PARENTS[1:22], 15, 15, 15, *_finger_parents(20, 25), *_finger_parents(21, 40)])
    model = NumpyBody(
        name="like SMPL-X",
        v_template=vertices,
        shapedirs=shapes,
        expressiondirs=expressions,
        posedirs=1e-4 * rng.normal(size=(body.num_vertices, 3, 9 * 54)),
        J_template=joint_places,
        J_shapedirs=joint_shapes,
        J_expressiondirs=joint_expressions,
        rest_rotation=np.tile(np.eye(3), (55, 1, 1)),
        weights=weights,
        faces=body.faces,
        parents=parents,
        joint_names=joints.SMPLX,
        hands=hands,
    )
    return ipt.BodyModel(model, torch.float64)


def _finger_parents(wrist: int, first: int) -> list[int]:
    return [parent for finger in range(5) for parent in (wrist, first + 3 * finger, first + 3 * finger + 1)]


def smplx_observed(batch: int, seed: int = 6) -> tuple[Problem, dict[str, Tensor]]:
    """As `observed`, of the body like SMPL-X with all its landmarks; the camera looks along −z as in a photo."""
    from ipman_rs.fitting import start
    from ipman_rs.fitting.landmarks import Landmarks

    generator = torch.Generator().manual_seed(seed)
    body = smplx_body()
    landmarks = Landmarks(body)
    size = torch.full((batch, 2), 640.0, dtype=torch.float64)
    level, here = start.level_camera().expand(batch, 3, 3).clone(), torch.zeros(batch, 3, dtype=torch.float64)
    camera = Camera(1.3 * size, size / 2, level, here)
    known = Problem(body, landmarks, camera, image_size=size)
    given = start.neutral(known)
    noise = {name: torch.randn(value.shape, generator=generator, dtype=torch.float64) for name, value in given.items()}
    given |= {name: given[name] + 0.1 * noise[name] for name in ("orient", "pose", "face", "betas")}
    given["expression"] = noise["expression"]
    given["transl"] = given["transl"] + torch.tensor([0.0, -0.9, -4.0], dtype=torch.float64)
    points = Candidate(known, given).projected
    confidence = torch.ones_like(points[..., 0])
    return replace(known, points=points, confidence=confidence), given


def held(batch: int, points: int, dtype: torch.dtype = torch.float64, seed: int = 8) -> dict[str, Tensor]:
    """What hypotheses and a detector of 3D points say of bodies: rows that sit and rows that stand, on one foot, on
    both or on neither, and one (the sixth) that moves; points (B, `points`, 3) of which one was not seen."""
    generator = torch.Generator().manual_seed(seed)
    relative = torch.randn(batch, points, 3, generator=generator, dtype=torch.float64)
    confidence = torch.rand(batch, points, generator=generator, dtype=torch.float64)
    confidence[0, 2] = 0
    others = torch.rand(batch, len(OTHERS), generator=generator) > 0.7
    row = torch.arange(batch)
    on_floor = row % 4 == 1
    return {
        "others_down": others & on_floor[:, None],
        "on_floor": on_floor,
        "feet_down": torch.stack([row % 4 < 2, row % 2 == 0], dim=1),
        "static": row != 5,
        "seated": row % 3 == 0,
        "relative_points": relative.to(dtype),
        "relative_confidence": confidence.to(dtype),
    }


def presented(batch: int = 1, dtype: torch.dtype = torch.float64, contact: Tensor | None = None) -> Presented:
    return Presented(variables(batch, dtype, seed=9)["pose"], contact)


def observed(batch: int, seed: int = 5) -> tuple[Problem, dict[str, Tensor]]:
    """Bodies before a camera, somewhat away from the points that were seen of them, with all of a body's landmarks."""
    from ipman_rs.fitting.landmarks import Landmarks

    generator = torch.Generator().manual_seed(seed)

    def noise(*shape: int) -> Tensor:
        return torch.randn(batch, *shape, generator=generator, dtype=torch.float64)

    given = variables(batch, seed=seed, scale=0.3)
    given["camera_transl"][:, 2] += 4
    landmarks = Landmarks(body_model())
    size = torch.full((batch, 2), 640.0, dtype=torch.float64)
    camera = Camera(800 + 50 * noise(2), size / 2, torch.eye(3, dtype=torch.float64).expand(batch, 3, 3), noise(3))
    known = Problem(body_model(), landmarks, camera, ipt.Ground.y_up(), image_size=size)
    seen = Candidate(known, given)
    confidence = 0.6 + 0.1 * noise(len(landmarks.names)).clamp(-2, 2)
    points, points_3d = seen.projected + 30 * noise(1, 2), seen.landmarks + 0.1 * noise(len(landmarks.names), 3)
    return replace(known, points=points, confidence=confidence, points_3d=points_3d, confidence_3d=confidence), given
