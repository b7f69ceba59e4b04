"""Hand prior: Σ c² of the hands' pose, as SMPLify-X and SMPLify-XMC weigh it.

c are the coefficients of each hand's principal components, where the body's file has them (SMPL-X, SMPL+H; see
`ipman_rs.body.hands`), relative to the mean hand that such a model adds by itself. What no component reaches counts as
its own square. Of other bodies c are the rotation vectors of the hands' joints, radians: `left_hand`, `right_hand` of
those with 24 joints.
"""

from __future__ import annotations

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor

from ipman_rs.body import joints

from ..candidate import Candidate
from ..problem import Problem
from ..variables import pose_joints
from .term import LeastSquares

HANDS = set(joints.SMPL + joints.SMPLH) - set(joints.BODY)


class HandPrior(LeastSquares):
    def __init__(self, problem: Problem):
        super().__init__(problem)
        body = problem.body.body
        self.joints = [index for index, name in enumerate(pose_joints(body)) if name in HANDS]
        sides = () if body.hands is None else (body.hands.left_components, body.hands.right_components)
        like = problem.body.v_template
        self.maps = [torch.from_numpy(coefficients(components)).to(like) for components in sides]

    def residuals(self, candidate: Candidate) -> Tensor:
        pose = candidate.variables["pose"][:, self.joints].flatten(1)
        if not self.maps:
            return pose
        halves = pose.chunk(2, dim=1)
        # multiplied and summed a body at a time, so that no batch size changes a bit
        return torch.cat(
            [(map * half[:, None]).sum(dim=-1) for map, half in zip(self.maps, halves, strict=True)], dim=1
        )


def coefficients(components: NDArray[np.float64]) -> NDArray[np.float64]:
    """The matrix that leads from a hand's 45 numbers to their coefficients (K), and to what K < 45 components leave."""
    inverse = np.linalg.pinv(components.T)
    if np.linalg.matrix_rank(components) == components.shape[1]:
        return inverse
    return np.concatenate([inverse, np.eye(components.shape[1]) - components.T @ inverse])
