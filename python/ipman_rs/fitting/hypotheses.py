"""What a photo leaves open, as hypotheses that are fitted side by side and weighed by one cost.

One image does not say how far the camera looks down, nor what holds a person up. A hypothesis is a pitch of the camera
and a support:

feet     the feet that are down hold the person up, at rest
seat     a seat does, too, at a height of its own
floor    hands, knees, hips, shoulders or head do, too, on the floor
nothing  the person moves: neither balance nor floor are asked for, and the pitch is the likeliest

The body is fitted to the image first, which no pitch changes: a camera that looks down and a body that leans back look
the same. Then every hypothesis starts from that body, turned as its pitch tells, and the stages that follow fit it with
its support. What is compared is the cost of all terms, that of the pitch, and the price of the support: an odd pose
must be bought by the image.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import product

import numpy as np
import torch
from torch import Tensor

from ..body.landmarks import SIDES
from .camera import Camera, level_camera
from .candidate import Candidate
from .landmarks import Landmarks
from .problem import Problem
from .rotations import matrix, vector
from .support_points import NAMES, OTHERS, TOES, support_points
from .variables import Variables

PITCH_PRIOR = ("mean", "deviation", "weight")
SUPPORTS = ("feet", "seat", "floor", "nothing")
_FEET = [NAMES.index(f"{side}_{point}") for side in SIDES for point in ("heel", "big_toe")]
_OTHERS = [NAMES.index(name) for name in OTHERS]
NEAR = 0.12  # m above the lowest: up to there the others count as down, and the terms may bring them to the floor


@dataclass(frozen=True)
class Hypotheses:
    """What a preset weighs.

    before: the stage from which on a person is several rows. pitches: degrees, looking down +. A pitch p costs
    weight ((p − mean) / deviation)², and each support its price.
    """

    before: str
    pitches: tuple[float, ...]
    mean: float
    deviation: float
    weight: float
    prices: Mapping[str, float]

    def pitch_cost(self, pitch: np.ndarray) -> np.ndarray:
        return self.weight * ((pitch - self.mean) / self.deviation) ** 2


@dataclass(frozen=True)
class Hypothesis:
    """pitch: degrees; nan where the camera is known. cost: of its terms, its pitch and its support."""

    support: str
    pitch: float
    cost: float


@dataclass(frozen=True)
class Rows:
    """Several rows of a problem for each person. person, support: of each row; pitch: degrees; image: that the person
    is in, with others perhaps."""

    person: np.ndarray
    support: np.ndarray
    pitch: np.ndarray
    image: np.ndarray

    def take(self, rows: np.ndarray) -> Rows:
        return Rows(self.person[rows], self.support[rows], self.pitch[rows], self.image[rows])


def expand(problem: Problem, variables: Variables, hypotheses: Hypotheses) -> tuple[Problem, dict[str, Tensor], Rows]:
    """Each person's rows: of all pitches with each support that rests, and of the likeliest with nothing."""
    pitches = (math.nan,) if problem.pitch_known else hypotheses.pitches
    likeliest = min(pitches, key=lambda pitch: abs(pitch - hypotheses.mean))
    # People of one photo must agree on a pitch, which one who moves has no word in.
    each = [*product(SUPPORTS[:3], pitches), *product(SUPPORTS[3:], (likeliest,) if problem.image is None else pitches)]
    people = problem.num_bodies
    rows = Rows(
        np.repeat(np.arange(people), len(each)),
        np.array([support for support, _ in each] * people),
        np.array([pitch for _, pitch in each] * people),
        np.repeat(np.arange(people) if problem.image is None else problem.image.numpy(), len(each)),
    )
    index = torch.from_numpy(rows.person)
    problem, variables = problem.rows(index), {name: value[index] for name, value in variables.items()}
    problem, variables = turn(problem, variables, rows)
    moves, seated, on_floor = (torch.from_numpy(rows.support == name) for name in ("nothing", "seat", "floor"))
    return replace(problem, static=~moves, seated=seated, on_floor=on_floor), variables, rows


def turn(problem: Problem, variables: Variables, rows: Rows) -> tuple[Problem, dict[str, Tensor]]:
    """The cameras of the rows, and the bodies turned with them, so that in the image nothing moves."""
    if problem.pitch_known:
        return problem, dict(variables)
    rotation = level_camera(torch.from_numpy(rows.pitch).deg2rad())
    turn = rotation.transpose(1, 2) @ problem.camera.rotation
    with torch.no_grad():
        pelvis = Landmarks(problem.body, problem.body.body.joint_names[:1])
        root = Candidate(problem, variables).points_of(pelvis)[:, 0]  # about which `orient` turns
    moved = (turn @ root[:, :, None])[..., 0] - (root - variables["transl"])
    variables = {
        **variables,
        "orient": vector(turn @ matrix(variables["orient"])),
        "transl": moved,
        "camera_orient": vector(rotation),
    }
    camera = problem.camera
    return replace(problem, camera=Camera(camera.focal, camera.center, rotation, camera.translation)), variables


def with_contacts(problem: Problem, variables: Variables) -> Problem:
    """The problem with what is down: the lower foot and, near its height, the other; of a body that the floor may hold
    by more than its feet, all that is near its lowest part. Nothing of a body that moves. Unchanged if the ground is
    unknown."""
    if problem.ground is None or problem.static is None:
        return problem
    with torch.no_grad():
        points = Candidate(problem, variables).points_of(support_points(problem.body))
        normal = problem.ground.normal.to(points).expand(len(points), 3)
        heights = (points * normal[:, None]).sum(dim=-1)
    feet = heights[:, _FEET].unflatten(1, (2, 2)).amin(dim=-1)
    others = heights[:, _OTHERS] - torch.tensor(list(OTHERS.values()), dtype=heights.dtype)
    lowest_foot = feet.amin(dim=1, keepdim=True)
    on_floor = torch.zeros(len(points), dtype=torch.bool) if problem.on_floor is None else problem.on_floor
    lowest = torch.where(on_floor[:, None], torch.minimum(lowest_foot, others.amin(dim=1, keepdim=True)), lowest_foot)
    static = problem.static[:, None]
    others_down = (others <= lowest + NEAR) & static & on_floor[:, None]
    toes = torch.tensor([name in TOES for name in OTHERS])
    others_down = others_down & (others_down & ~toes).any(dim=1, keepdim=True)
    return replace(problem, feet_down=(feet <= lowest + NEAR) & static, others_down=others_down)


def distinct(problem: Problem) -> np.ndarray:
    """The rows that differ from all others: where feet alone are down, the floor holds nobody by more than those."""
    assert problem.on_floor is not None
    assert problem.others_down is not None
    twin = problem.on_floor & ~problem.others_down.any(dim=1)
    return np.flatnonzero(~twin.numpy())


def weigh(terms: Mapping[str, np.ndarray], rows: Rows, hypotheses: Hypotheses) -> list[list[tuple[int, Hypothesis]]]:
    """Each person's rows and what they cost, the cheapest first; a cost that is not finite comes last. To a row's cost
    belongs what its pitch costs the other people in the photo, so that all of them take the same."""
    cost = sum(terms.values(), np.zeros(len(rows.person)))
    cost = cost + np.array([hypotheses.prices[support] for support in rows.support])
    cost = np.where(np.isfinite(cost), cost, np.inf)
    cost = cost + _cost_of_others(cost, rows) + np.nan_to_num(hypotheses.pitch_cost(rows.pitch), nan=0.0)
    order = np.lexsort((np.arange(len(cost)), cost, rows.person))
    weighed: list[list[tuple[int, Hypothesis]]] = [[] for _ in range(rows.person[-1] + 1)]
    for row in order:
        own = Hypothesis(str(rows.support[row]), float(rows.pitch[row]), float(cost[row]))
        weighed[rows.person[row]].append((int(row), own))
    return weighed


def _cost_of_others(cost: np.ndarray, rows: Rows) -> np.ndarray:
    """For each row, the least that the other people of its image cost at its pitch, summed; infinite where one of them
    has no row of it."""
    others = np.zeros(len(cost))
    if len(np.unique(rows.image)) == len(np.unique(rows.person)):
        return others
    for row in range(len(cost)):
        same = (rows.image == rows.image[row]) & (rows.person != rows.person[row])
        for person in np.unique(rows.person[same]):
            theirs = (rows.person == person) & (np.nan_to_num(rows.pitch) == np.nan_to_num(rows.pitch[row]))
            others[row] += cost[theirs].min(initial=np.inf)
    return others


def best(weighed: Sequence[Sequence[tuple[int, Hypothesis]]], keep: int) -> np.ndarray:
    """The rows of the `keep` cheapest of each person, in their order."""
    return np.array(sorted(row for own in weighed for row, _ in own[:keep]))
